"""Databases: the answers of `oblique query` and `oblique sql`."""

import csv
import io
import pathlib
import pickle
import sqlite3

import numpy as np
import pytest

import oblique
from conftest import run_oblique


def rows_of_program(*arguments):
    return list(csv.DictReader(io.StringIO(run_oblique(*arguments, "--format", "csv"))))


def test_a_database_and_its_answer_can_be_pickled(database):
    opened = pickle.loads(pickle.dumps(oblique.Database(database)))
    answer = pickle.loads(pickle.dumps(opened.query("sweep", select="mu, mode")))
    assert opened.file == database and opened.studies()[0].name == "sweep"
    assert answer.mu.tolist() == oblique.Database(database).query("sweep", select="mu").mu.tolist()


@pytest.mark.parametrize(
    "keys",
    [
        {},
        {"where": "mu > 0.5 AND e = 1", "select": "mu, fn_peak_N, mode", "order": "fn_peak_N DESC"},
        {"group": "major_mode", "select": "major_mode, count(*), max(fn_peak_N)"},
        {"select": "*", "limit": 3},
        {"select": "peaks[0].fn_N, stick_total_s", "where": "H = 1"},
        {"where": "mu > 100"},
    ],
)
def test_answers_equal_those_of_the_program(database, keys):
    flags = [text for key, value in keys.items() for text in ("--" + key, str(value))]
    rows = rows_of_program("query", "sweep", "--db", database, *flags)
    answer = oblique.Database(database).query("sweep", **keys)
    assert len(answer) == len(rows)
    for name in answer:
        for value, row in zip(answer[name].tolist(), rows):
            text = row[name]
            if text == "":
                assert value is None or value == "" or np.isnan(value)
            else:
                assert text == value if isinstance(value, str) else float(text) == value


def test_columns_are_arrays_with_types_and_units(database):
    answer = oblique.Database(pathlib.Path(database)).query(
        "sweep", select=["point", "mu", "fn_peak_N", "mode", "error", "ft_peak_error"]
    )
    assert [answer[name].dtype.kind for name in answer] == ["i", "f", "f", "O", "O", "f"]
    assert answer.units["fn_peak_N"] == "N" and answer.units["mode"] == ""
    assert answer.error[0] is None and np.isnan(answer.ft_peak_error).all()
    assert answer.fn_peak_N is answer["fn_peak_N"]
    assert list(answer.to_pandas().columns) == answer.keys()
    assert repr(answer) == "<36 rows: point, mu, fn_peak_N, mode, error, ft_peak_error>"
    with pytest.raises(KeyError, match="no field 'fn'"):
        answer["fn"]


def test_results_equal_those_of_solve_in_the_stored_digits(database):
    answer = oblique.Database(database).query("sweep", select="H, mu, e, fn_peak_N, slide_m, mode")
    here = oblique.solve_many(answer.H, answer.mu, answer.e)
    assert np.allclose(here.fn_peak_N, answer.fn_peak_N, rtol=1e-8, atol=0)
    assert np.allclose(here.slide_m, answer.slide_m, rtol=1e-8, atol=1e-10)
    assert np.array_equal(here.mode, answer["mode"])


def test_sql_is_answered_and_cannot_change_anything(database):
    opened = oblique.Database(database)
    answer = opened.sql("SELECT count(*) AS n, max(mu) AS m, min(mu) AS m FROM runs")
    assert (answer.m.tolist(), answer.keys()) == ([2.0], ["n", "m", "m_2"])
    for statement in ("DELETE FROM results", "SELECT 1; SELECT 2", "SELEC 1", "ATTACH 'x' AS y"):
        with pytest.raises(ValueError):
            opened.sql(statement)


def test_a_database_is_read_after_a_change_of_folder(database, tmp_path, monkeypatch):
    (tmp_path / "copy.db").write_bytes(pathlib.Path(database).read_bytes())
    monkeypatch.chdir(tmp_path)
    opened = oblique.Database("copy.db")
    monkeypatch.chdir("/")
    assert len(opened.query("sweep", limit=2)) == 2


def test_studies_have_their_progress(database):
    (study,) = oblique.Database(database).studies()
    assert (study.name, study.state, study.points, study.solved) == ("sweep", "done", 36, 36)


@pytest.mark.parametrize(
    "study, keys, sentence",
    [
        ("swep", {}, 'did you mean'),
        ("sweep", {"select": "fn_peak"}, "no such column: fn_peak (did you mean `fn_peak_N`"),
        ("sweep", {"where": "mu >"}, 'where "mu >" is not allowed'),
        ("sweep", {"limit": -1}, "limit = -1 is not allowed"),
    ],
)
def test_wrong_names_are_value_errors_with_the_nearest_names(database, study, keys, sentence):
    with pytest.raises(ValueError) as error:
        oblique.Database(database).query(study, **keys)
    assert sentence in str(error.value)


def test_other_files_are_refused_with_their_kind(tmp_path):
    with pytest.raises(FileNotFoundError, match="nothing.db"):
        oblique.Database(tmp_path / "nothing.db")
    assert not list(tmp_path.iterdir())
    (tmp_path / "text.db").write_text("hello, this is no database at all, only text" * 100)
    for wrong in ("text.db", "."):
        with pytest.raises(oblique.DatabaseError):
            oblique.Database(tmp_path / wrong)


def test_new_rows_are_visible_to_the_next_query(database, tmp_path):
    file = str(tmp_path / "copy.db")
    with sqlite3.connect(database) as one, sqlite3.connect(file) as other:
        one.backup(other)
    opened = oblique.Database(file)
    assert len(opened.query("sweep")) == 36
    run_oblique("run", "--H", "1", "--mu", "0.3", "--e", "0.7", "--name", "more", "--db", file)
    assert [study.name for study in opened.studies()] == ["sweep", "more"]
    assert len(opened.query("more")) == 1
