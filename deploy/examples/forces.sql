-- The largest normal force by drop and coefficient of friction, at the largest restitution.
.mode csv
.headers on
SELECT H, mu, fn_peak_N
FROM runs
WHERE study_id = (SELECT min(study_id) FROM studies) AND status = 'solved'
GROUP BY H, mu
HAVING e = max(e)
ORDER BY H, mu;
