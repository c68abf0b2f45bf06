-- The views of the database. Those that users add stay.

-- One row for each settled point, in SI units. Dividing by a power of ten gives the double that is
-- nearest to the decimal number. Lists are JSON arrays with an array for each element; one that is damaged
-- is NULL and makes no rows, so that the others can be asked for (`oblique check` names it). Modes are joined
-- because most questions show them; other texts are looked up, which costs nothing where a question does
-- without: SQLite 3.40 keeps joins that an aggregate does not need.
CREATE VIEW results AS
SELECT p.study_id AS study_id, p.point AS point, p.model_id AS model_id, p.H AS H, p.mu AS mu, p.e AS e,
       CASE WHEN p.error IS NULL THEN 'solved' ELSE 'failed' END AS status, p.error AS error,
       p.fall_time / 1e9 AS fall_time_s, p.impact_x / 1e9 AS impact_x_m, p.vt_in / 1e8 AS vt_in_m_s,
       p.vn_in / 1e8 AS vn_in_m_s, p.duration / 1e12 AS duration_s, p.fn_peak / 1e5 AS fn_peak_N,
       p.ft_peak / 1e5 AS ft_peak_N, p.major_peak_1 / 1e5 AS major_peak_1_N,
       p.major_peak_2 / 1e5 AS major_peak_2_N, p.major_peak_3 / 1e5 AS major_peak_3_N,
       p.major_peak_1_t / 1e12 AS major_peak_1_t_s, p.major_peak_2_t / 1e12 AS major_peak_2_t_s,
       p.major_peak_3_t / 1e12 AS major_peak_3_t_s, p.impulse_n / 1e9 AS impulse_n_Ns,
       p.impulse_t / 1e9 AS impulse_t_Ns, p.slide / 1e11 AS slide_m, p.vt_out / 1e8 AS vt_out_m_s,
       p.vn_out / 1e8 AS vn_out_m_s, mode.text AS mode, major_mode.text AS major_mode,
       p.stick_total / 1e12 AS stick_total_s,
       CASE WHEN json_valid(p.peaks) THEN
         (SELECT json_group_array(json_array(
                   t.value / 1e12, abs(p.peaks ->> (t.key + 1)) / 1e5, (p.peaks ->> (t.key + 2)) / 1e5,
                   p.peaks ->> (t.key + 1) >= 0))
          FROM json_each(p.peaks) AS t WHERE t.key % 3 = 0) END AS peaks,
       CASE WHEN p.peaks IS NOT NULL THEN CASE WHEN p.ft_peaks IS NOT NULL THEN CASE WHEN json_valid(p.ft_peaks) THEN
         (SELECT json_group_array(json_array(t.value / 1e12, (p.ft_peaks ->> (t.key + 1)) / 1e5))
          FROM json_each(p.ft_peaks) AS t WHERE t.key % 2 = 0) END WHEN json_valid(p.peaks) THEN
         (SELECT json_group_array(json_array(t.value / 1e12, (p.peaks ->> (t.key + 2)) / 1e5))
          FROM json_each(p.peaks) AS t WHERE t.key % 3 = 0) END END AS ft_peaks,
       CASE WHEN p.peaks IS NOT NULL AND (p.phases IS NULL OR json_valid(p.phases)) AND abs(p.duration) < 9e999 THEN
         (SELECT json_group_array(json_array(
                   CASE t.key % 2 WHEN 0 THEN 'compression' ELSE 'restitution' END,
                   CASE t.key WHEN 0 THEN 0.0 ELSE (p.phases ->> (t.key - 1)) / 1e12 END,
                   t.value / 1e12))
          FROM json_each(json_insert(p.phases, '$[#]', p.duration)) AS t) END AS phases,
       CASE WHEN json_valid(p.stick_intervals) THEN
         (SELECT json_group_array(json_array(
                   t.value / 1e12, (p.stick_intervals ->> (t.key + 1)) / 1e12))
          FROM json_each(p.stick_intervals) AS t WHERE t.key % 2 = 0) END AS stick_intervals,
       p.kinetic_in / 1e8 AS kinetic_in_J, p.friction / 1e9 AS friction_J,
       p.restitution / 1e9 AS restitution_J, p.kinetic_change / 1e9 AS kinetic_change_J,
       p.strain_change / 1e9 AS strain_change_J, p.gravity_change / 1e9 AS gravity_change_J,
       p.exchanged / 1e9 AS exchanged_J, p.closure / 1e14 AS closure, p.dt / 1e15 AS dt_s,
       p.steps AS steps, p.wall / 1e9 AS wall_s, p.worker AS worker,
       (SELECT solver_version FROM workers WHERE worker_id = p.worker) AS solver_version,
       (SELECT instruction_set FROM workers WHERE worker_id = p.worker) AS instruction_set,
       p.attempt AS attempt,
       CASE typeof(p.solved_at) WHEN 'integer'
            THEN strftime('%Y-%m-%dT%H:%M:%fZ', p.solved_at / 1000.0, 'unixepoch') ELSE p.solved_at END AS solved_at,
       CASE WHEN json_valid(p.reaction_peaks) THEN
         (SELECT json_group_array(json_array(t.value / 1e12, (p.reaction_peaks ->> (t.key + 1)) / 1e5))
          FROM json_each(p.reaction_peaks) AS t WHERE t.key % 2 = 0) END AS reaction_peaks,
       p.checksum AS checksum, p.margin / 1e9 AS margin,
       (SELECT text FROM texts WHERE text_id = p.margin_event) AS margin_event,
       p.mode_same AS mode_same, p.fn_peak_error / 1e9 AS fn_peak_error,
       p.ft_peak_error / 1e9 AS ft_peak_error, p.duration_error / 1e9 AS duration_error,
       p.stick_total_error / 1e9 AS stick_total_error, p.slide_error / 1e9 AS slide_error,
       p.impulse_n_error / 1e9 AS impulse_n_error, p.impulse_t_error / 1e9 AS impulse_t_error,
       p.v_out_error / 1e9 AS v_out_error,
       CASE WHEN p.taken_from IS NOT NULL THEN
         coalesce((SELECT o.name FROM origins AS o WHERE o.origin_id = CAST(p.taken_from AS INTEGER)),
                  'study number ' || CAST(p.taken_from AS INTEGER))
         || substr(p.taken_from, instr(p.taken_from, '/')) END AS taken_from
FROM packed_results AS p
LEFT JOIN texts AS mode ON mode.text_id = p.mode
LEFT JOIN texts AS major_mode ON major_mode.text_id = p.major_mode;

-- The lists as rows; `seq` counts from 0.
CREATE VIEW peaks AS
SELECT p.study_id AS study_id, p.point AS point, t.key / 3 AS seq, t.value / 1e12 AS t_s,
       abs(p.peaks ->> (t.key + 1)) / 1e5 AS fn_N, (p.peaks ->> (t.key + 2)) / 1e5 AS ft_N,
       p.peaks ->> (t.key + 1) >= 0 AS major
FROM packed_results AS p, json_each(CASE WHEN json_valid(p.peaks) THEN p.peaks END) AS t
WHERE t.key % 3 = 0;

CREATE VIEW phases AS
SELECT p.study_id AS study_id, p.point AS point, t.key AS seq,
       CASE t.key % 2 WHEN 0 THEN 'compression' ELSE 'restitution' END AS kind,
       CASE t.key WHEN 0 THEN 0.0 ELSE (p.phases ->> (t.key - 1)) / 1e12 END AS t0_s,
       t.value / 1e12 AS t1_s
FROM packed_results AS p, json_each(CASE WHEN json_valid(p.phases) AND abs(p.duration) < 9e999
                                         THEN json_insert(p.phases, '$[#]', p.duration) END) AS t;

CREATE VIEW stick_intervals AS
SELECT p.study_id AS study_id, p.point AS point, t.key / 2 AS seq, t.value / 1e12 AS t0_s,
       (p.stick_intervals ->> (t.key + 1)) / 1e12 AS t1_s
FROM packed_results AS p, json_each(CASE WHEN json_valid(p.stick_intervals) THEN p.stick_intervals END) AS t
WHERE t.key % 2 = 0;

-- `seq` 0 is the pin O, 1 the first joint from there.
CREATE VIEW reaction_peaks AS
SELECT p.study_id AS study_id, p.point AS point, t.key / 2 AS seq, t.value / 1e12 AS t_s,
       (p.reaction_peaks ->> (t.key + 1)) / 1e5 AS force_N
FROM packed_results AS p, json_each(CASE WHEN json_valid(p.reaction_peaks) THEN p.reaction_peaks END) AS t
WHERE t.key % 2 = 0;

-- For people: study name, outputs and model beside each other. Young's modulus is E_Pa here, for
-- column names do not tell E from e.
CREATE VIEW runs AS
SELECT s.name AS study, r.study_id AS study_id, r.point AS point, r.H AS H, r.mu AS mu, r.e AS e,
       r.status AS status, r.error AS error, r.fall_time_s AS fall_time_s,
       r.impact_x_m AS impact_x_m, r.vt_in_m_s AS vt_in_m_s, r.vn_in_m_s AS vn_in_m_s,
       r.duration_s AS duration_s, r.fn_peak_N AS fn_peak_N, r.ft_peak_N AS ft_peak_N,
       r.major_peak_1_N AS major_peak_1_N, r.major_peak_2_N AS major_peak_2_N,
       r.major_peak_3_N AS major_peak_3_N, r.major_peak_1_t_s AS major_peak_1_t_s,
       r.major_peak_2_t_s AS major_peak_2_t_s, r.major_peak_3_t_s AS major_peak_3_t_s,
       r.impulse_n_Ns AS impulse_n_Ns, r.impulse_t_Ns AS impulse_t_Ns, r.slide_m AS slide_m,
       r.vt_out_m_s AS vt_out_m_s, r.vn_out_m_s AS vn_out_m_s, r.mode AS mode,
       r.major_mode AS major_mode, r.stick_total_s AS stick_total_s, r.peaks AS peaks,
       r.ft_peaks AS ft_peaks, r.phases AS phases, r.stick_intervals AS stick_intervals,
       r.reaction_peaks AS reaction_peaks, r.margin AS margin, r.margin_event AS margin_event,
       r.kinetic_in_J AS kinetic_in_J, r.friction_J AS friction_J,
       r.restitution_J AS restitution_J, r.kinetic_change_J AS kinetic_change_J,
       r.strain_change_J AS strain_change_J, r.gravity_change_J AS gravity_change_J,
       r.exchanged_J AS exchanged_J, r.closure AS closure, r.mode_same AS mode_same,
       r.fn_peak_error AS fn_peak_error, r.ft_peak_error AS ft_peak_error,
       r.duration_error AS duration_error, r.stick_total_error AS stick_total_error,
       r.slide_error AS slide_error, r.impulse_n_error AS impulse_n_error,
       r.impulse_t_error AS impulse_t_error, r.v_out_error AS v_out_error, r.dt_s AS dt_s,
       r.steps AS steps,
       r.wall_s AS wall_s, r.worker AS worker, w.name AS worker_name,
       r.solver_version AS solver_version, r.instruction_set AS instruction_set,
       r.attempt AS attempt, r.solved_at AS solved_at, r.model_id AS model_id, m.links AS links,
       m.length AS length, m.lengths_m AS lengths_m, m.E AS E_Pa, m.A AS A, m.I AS I, m.rho AS rho,
       m.g AS g, m.elements_per_link AS elements_per_link, m.k AS k, m.eta2 AS eta2,
       m.tip_mass AS tip_mass, m.integrator AS integrator,
       m.spectral_radius AS spectral_radius, m.dt AS dt, m.dt_fall AS dt_fall,
       m.tolerance AS tolerance, r.taken_from AS taken_from
FROM results AS r
JOIN studies AS s ON s.study_id = r.study_id
JOIN models AS m ON m.model_id = r.model_id
LEFT JOIN workers AS w ON w.worker_id = r.worker;
