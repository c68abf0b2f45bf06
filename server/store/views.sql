-- The views. A server whose file lacks one of them, or has another one of that name, makes it again. They come
-- before the tables: SQLite compares its list of free pages with all pages in use only if the newest elements of
-- the schema are tables.

-- JSON writes whole numbers without a point; the casts keep them real numbers in SQL.
CREATE VIEW peaks AS
SELECT r.study_id, r.point, p.key AS seq, CAST(p.value ->> 0 AS REAL) AS t_s, CAST(p.value ->> 1 AS REAL) AS fn_N,
       CAST(p.value ->> 2 AS REAL) AS ft_N, p.value ->> 3 AS major
FROM results AS r, json_each(r.peaks) AS p;

CREATE VIEW phases AS
SELECT r.study_id, r.point, p.key AS seq, CASE p.key % 2 WHEN 0 THEN 'compression' ELSE 'restitution' END AS kind,
       CASE p.key WHEN 0 THEN 0.0 ELSE CAST(r.phases ->> (p.key - 1) AS REAL) END AS t0_s,
       CAST(p.value AS REAL) AS t1_s
FROM results AS r, json_each(r.phases) AS p;

CREATE VIEW stick_intervals AS
SELECT r.study_id, r.point, s.key AS seq, CAST(s.value ->> 0 AS REAL) AS t0_s, CAST(s.value ->> 1 AS REAL) AS t1_s
FROM results AS r, json_each(r.stick_intervals) AS s;

-- `seq` 0 is the pin O, 1 the first joint from there.
CREATE VIEW reaction_peaks AS
SELECT r.study_id, r.point, f.key AS seq, CAST(f.value ->> 0 AS REAL) AS t_s, CAST(f.value ->> 1 AS REAL) AS force_N
FROM results AS r, json_each(r.reaction_peaks) AS f;

-- Study name, results, all lists, worker and model in one row. Young's modulus is called E_Pa,
-- because column names do not distinguish E from e.
CREATE VIEW runs AS
SELECT s.name AS study, r.study_id, r.point, r.H, r.mu, r.e, r.status, r.error, r.fall_time_s, r.impact_x_m,
       r.vt_in_m_s, r.vn_in_m_s, r.duration_s, r.fn_peak_N, r.ft_peak_N, r.major_peak_1_N, r.major_peak_2_N,
       r.major_peak_3_N, r.major_peak_1_t_s, r.major_peak_2_t_s, r.major_peak_3_t_s, r.impulse_n_Ns,
       r.impulse_t_Ns, r.slide_m, r.vt_out_m_s, r.vn_out_m_s, r.mode, r.major_mode, r.stick_total_s, r.peaks,
       CASE WHEN r.error IS NULL THEN coalesce(r.ft_peaks,
         (SELECT json_group_array(json_array(p.value ->> 0, p.value ->> 2)) FROM json_each(r.peaks) AS p))
       END AS ft_peaks,
       CASE WHEN r.error IS NULL THEN
         (SELECT json_group_array(json_array(CASE p.key % 2 WHEN 0 THEN 'compression' ELSE 'restitution' END,
                   CASE p.key WHEN 0 THEN 0.0 ELSE r.phases ->> (p.key - 1) END, p.value))
          FROM json_each(r.phases) AS p)
       END AS phases,
       r.stick_intervals, r.reaction_peaks, r.margin, r.margin_event, r.kinetic_in_J, r.friction_J,
       r.restitution_J, r.kinetic_change_J, r.strain_change_J, r.gravity_change_J, r.exchanged_J, r.closure,
       r.mode_same, r.fn_peak_error, r.ft_peak_error, r.duration_error, r.stick_total_error, r.slide_error,
       r.impulse_n_error, r.impulse_t_error, r.v_out_error, r.dt_s, r.steps, r.wall_s, r.worker_id,
       w.name AS worker_name, w.solver_version, w.instruction_set, r.attempt, r.solved_at, r.model_id, m.links,
       m.length, m.lengths_m, m.E AS E_Pa, m.A, m.I, m.rho, m.g, m.elements_per_link, m.k, m.eta2, m.tip_mass,
       m.integrator, m.spectral_radius, m.dt, m.dt_fall, m.tolerance, r.reused_from
FROM results AS r
JOIN studies AS s ON s.study_id = r.study_id
JOIN models AS m ON m.model_id = r.model_id
LEFT JOIN workers AS w ON w.worker_id = r.worker_id;
