"""A grid as a labelled cube over H, mu and e: the forces of forces.py, and the longest stick of P."""
import sqlite3
import sys

import pandas

database = sqlite3.connect(f"file:{sys.argv[1]}?mode=ro", uri=True)
runs = pandas.read_sql_query(
    "SELECT H, mu, e, fn_peak_N, stick_total_s FROM runs"
    " WHERE study_id = (SELECT min(study_id) FROM studies) AND status = 'solved'",
    database,
)
cube = runs.set_index(["H", "mu", "e"]).to_xarray()  # an xarray.Dataset; the study must be a grid
# If the study has grown, some cells of the cube may be empty.
forces = cube.fn_peak_N.to_dataframe().dropna().reset_index().sort_values(["H", "mu", "e"])
forces = forces.groupby(["H", "mu"], as_index=False).last()[["H", "mu", "fn_peak_N"]]
print(forces.to_csv(index=False), end="")

# Lists have their own views: stick_intervals has a row per interval in which particle P sticks.
spans = pandas.read_sql_query(
    "SELECT point, t0_s, t1_s FROM stick_intervals WHERE study_id = (SELECT min(study_id) FROM studies)",
    database,
)
longest = (spans.t1_s - spans.t0_s).max()
print(f"longest span in stick: {longest * 1e6:.1f} us" if len(spans) else "P never sticks", file=sys.stderr)
