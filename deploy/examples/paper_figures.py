"""The paper's figures 4 to 7, solved here, and its published numbers beside ours.

Cells begin with # %%: editors as VS Code, Spyder and Jupyter (jupytext) run them one by one. As a script:
  python3 paper_figures.py           writes figure4.png ... figure7.png and prints a table
"""
# %% Groups of the paper: each varies one quantity; the others are H = 1 m, mu = 0.4, e* = 1
import matplotlib
matplotlib.use("Agg")  # remove this line in a notebook
import numpy as np
from matplotlib import pyplot

import oblique

GROUPS = {
    "drop H [m]": [(H, 0.4, 1.0) for H in (0.96, 1.00, 1.04)],
    "restitution\ne*": [(1.0, 0.4, e) for e in (0.6, 0.8, 1.0)],
    "friction µ\nslip": [(1.0, mu, 1.0) for mu in (0.4, 0.6, 0.8)],
    "friction µ\nfirst stick": [(1.0, mu, 1.0) for mu in (1.2, 1.4, 1.6)],
}
VARIED = [0, 2, 1, 1]  # which of H, mu and e

# Tab. 2 [kN] by (H, mu, e): normal forces of all peaks, then tangential forces. The columns of H =
# 0.96 and 1.04 m are misprinted: they repeat other columns, and the numbers under 1.00 m belong to
# 1.04 m.
PUBLISHED = {
    (1.00, 0.4, 0.6): ([5.07, 1.80, 2.77], [2.03, 0.72, 1.11]),
    (1.00, 0.4, 0.8): ([5.07, 1.73, 2.57], [2.03, 0.70, 1.03]),
    (1.00, 0.4, 1.0): ([5.07, 1.50, 2.36], [2.03, 0.60, 0.94]),
    (1.04, 0.4, 1.0): ([5.22, 1.33, 2.45], [2.09, 0.53, 0.98]),
    (1.00, 0.6, 1.0): ([4.76, 1.58, 2.38], [2.85, 0.95, 1.43]),
    (1.00, 0.8, 1.0): ([4.48, 1.61, 2.45], [3.58, 1.29, 1.96]),
    (1.00, 1.2, 1.0): ([4.28, 1.56], [4.92, 1.88]),
    (1.00, 1.4, 1.0): ([4.28, 1.49], [4.96, 2.08]),
    (1.00, 1.6, 1.0): ([4.28, 1.42], [4.96, 2.26]),
}

# Section 4.3: duration of the initial stick [ms].
STICK_MS = {(1.0, 1.2, 1.0): 0.070, (1.0, 1.4, 1.0): 0.083, (1.0, 1.6, 1.0): 0.092}

# %% Solves the time histories. Solving the fall takes 0.1 s, and each contact then 1 ms
points = sorted({point for group in GROUPS.values() for point in group})
contacts = {point: oblique.trace(*point, preset="paper") for point in points}


# %% Draws four panels per figure, one for each group
def figure(number, title, xlabel, ylabel, draw):
    sheet, panels = pyplot.subplots(2, 2, figsize=(11, 6.5), layout="constrained")
    for axes, (name, group), varied in zip(panels.flat, GROUPS.items(), VARIED):
        for i, point in enumerate(group):
            draw(axes, contacts[point], point, f"C{i}", f"{point[varied]:g}")
        axes.set(xlabel=xlabel, ylabel=ylabel)
        axes.legend(title=name, fontsize="small", title_fontsize="small", loc="upper left", bbox_to_anchor=(1, 1))
    sheet.suptitle(f"Fig. {number}: {title}")
    sheet.savefig(f"figure{number}.png", dpi=110)


def mark(axes, x, y, colour):
    """A published number."""
    axes.plot(x, y, colour, marker="D", markersize=4, markeredgecolor="black", linestyle="none")


def forces(axes, contact, point, colour, label):
    axes.plot(contact.t_s * 1e3, contact.fn_N / 1e3, colour, label=label)
    axes.plot(contact.t_s * 1e3, contact.ft_N / 1e3, colour, linestyle="--")
    # The paper gives no times of peaks, so its peaks are drawn at the times of our peaks.
    for force, published in zip((contact.fn_N, contact.ft_N), PUBLISHED.get(point, ([], []))):
        for t, kN in zip(peak_times(contact, force, len(published)), published):
            mark(axes, t * 1e3, kN, colour)


def velocity(axes, contact, point, colour, label):
    axes.plot(contact.t_s * 1e3, contact.vP_m_s, colour, label=label)
    if point in STICK_MS:
        mark(axes, STICK_MS[point], 0, colour)


def peak_times(contact, force, count):
    """When |force| has its `count` highest peaks, in order of time: ripples are lower."""
    size = np.abs(force)
    tops = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:])) + 1
    return contact.t_s[np.sort(tops[np.argsort(size[tops])[len(tops) - min(count, len(tops)):]])]


figure(4, "normal (full) and tangential forces; diamonds: Tab. 2", "t [ms]", "force [kN]", forces)
figure(5, "normal deformation of the contact", "t [ms]", "$u_y$ [mm]",
       lambda axes, contact, _, colour, label: axes.plot(contact.t_s * 1e3, contact.uy_m * 1e3, colour, label=label))
figure(6, "velocity of P along the ground; diamonds: published ends of stick", "t [ms]", "$v_P$ [m/s]", velocity)
figure(7, "trajectory of the fingertip", "x [mm]", "y + H [mm]",
       lambda axes, contact, point, colour, label: axes.plot(
           (contact.x_m - contact.x_m[0]) * 1e3, (contact.y_m + point[0]) * 1e3, colour, label=label))

# %% Prints a table of the largest forces at all points
H, mu, e = np.array(list(PUBLISHED)).T
ours = oblique.solve_many(H=H, mu=mu, e=e, preset="paper")
print("   H   mu   e*   F_n [kN] published  F_t [kN] published")
differences = []
for i, (point, (normal, tangential)) in enumerate(PUBLISHED.items()):
    fn_kN, ft_kN = ours.fn_peak_N[i] / 1e3, ours.ft_peak_N[i] / 1e3
    differences += [fn_kN / max(normal) - 1, ft_kN / max(tangential) - 1]
    print("{:4.2f} {:4.1f} {:4.1f}".format(*point), f"{fn_kN:9.2f} {max(normal):9.2f} {ft_kN:9.2f} {max(tangential):9.2f}")
print(f"largest difference: {100 * max(map(abs, differences)):.1f} %")
