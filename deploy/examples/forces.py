"""The largest normal force by drop and coefficient of friction, at the largest restitution."""
import sqlite3
import sys

# Opens the file read-only, because a server may use it.
database = sqlite3.connect(f"file:{sys.argv[1]}?mode=ro", uri=True)
rows = database.execute(
    "SELECT H, mu, fn_peak_N, max(e) FROM runs"
    " WHERE study_id = (SELECT min(study_id) FROM studies) AND status = 'solved'"
    " GROUP BY H, mu ORDER BY H, mu"
)
print("H,mu,fn_peak_N")
for H, mu, fn_peak_N, _ in rows:
    print(f"{H!r},{mu!r},{fn_peak_N!r}")
