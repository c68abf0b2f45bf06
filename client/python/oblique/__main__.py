"""``python3 -m oblique``: see :func:`oblique.about`."""

from ._about import about

if __name__ == "__main__":
    print(about())
