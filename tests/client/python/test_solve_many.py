"""Many points: arrays in, arrays out."""

import numpy as np
import pytest

import oblique


def test_many_points_have_the_bits_of_each_alone_in_the_shape_of_the_input():
    mu, e = np.meshgrid([0.0, 0.4, 1.5], [0.5, 1.0])
    many = oblique.solve_many(1, mu, e)
    assert many.shape == many.fn_peak_N.shape == many.mode.shape == (2, 3)
    for place in np.ndindex(2, 3):
        one = oblique.solve(1, mu[place], e[place])
        assert many.fn_peak_N[place] == one.fn_peak_N
        assert many.energy.closure[place] == one.energy.closure
        assert many.solver.steps[place] == one.solver.steps
        assert many.mode[place] == one.mode
        assert many.fn_peaks_N[place].tolist() == one.fn_peaks_N
        assert many.major_peaks_N[place].tolist() == one.major_peaks_N
        assert many.stick_intervals_s[place].tolist() == one.stick_intervals_s
        assert [dict(zip(p.dtype.names, p.tolist())) for p in many.phases[place]] == one.phases
        assert many.reaction_peaks[place]["force_N"].tolist() == [
            peak["force_N"] for peak in one.reaction_peaks
        ]


def test_lists_views_of_other_types_and_single_values_are_taken_as_numpy_takes_them():
    whole = oblique.solve_many(1, [0.2, 0.4, 0.6, 0.8], 1)
    strided = oblique.solve_many(1, np.array([0.2, 9, 0.4, 9, 0.6, 9, 0.8, 9])[::2], np.float32(1))
    assert np.array_equal(whole.fn_peak_N, strided.fn_peak_N)
    alone = oblique.solve_many(1, 0.2, 1)
    assert alone.shape == () and alone.fn_peak_N == whole.fn_peak_N[0]
    assert alone.fn_peaks_N[()].size >= 1
    assert oblique.solve_many([1], [[0.2], [0.4]], [1, 0.9, 0.8]).fn_peak_N.shape == (2, 3)


def test_no_points_give_no_results():
    nothing = oblique.solve_many(1, np.empty((0, 3)), 1)
    assert nothing.shape == (0, 3) and nothing.fn_peaks_N.shape == (0, 3)
    assert nothing.ragged("phases")[1].tolist() == [0]
    assert len(nothing.to_pandas()) == 0


def test_keys_of_the_model_may_be_arrays_and_expressions():
    k = np.array([1e7, 2e7, 4e7])
    many = oblique.solve_many(1, 0.4, 1, k=k, E=[70e9, 71e9, 70e9], elements_per_link=2)
    for i in range(3):
        one = oblique.solve(1, 0.4, 1, k=k[i], E=[70e9, 71e9, 70e9][i], elements_per_link=2)
        assert many.fn_peak_N[i] == one.fn_peak_N
    by_name = oblique.solve_many(1, [0.4, 0.8], "1 - mu / 2", elements_per_link=2)
    assert by_name.e.tolist() == [0.8, 0.6]
    assert by_name.fn_peak_N[1] == oblique.solve(1, 0.8, 0.6, elements_per_link=2).fn_peak_N
    ways = oblique.solve_many(1, 0.4, 1, integrator=["explicit", "generalized-alpha"], elements_per_link=1)
    assert ways.solver.integrator.tolist() == ["explicit", "generalized-alpha"]


def test_points_that_fail_are_nan_with_their_reason_and_leave_the_others_alone():
    many = oblique.solve_many([1, 5, 1, 1.19], [0.4, 0.4, np.nan, 0.4], 1, E=[70e9, 70e9, 70e9, -1])
    assert many.failed.tolist() == [False, True, True, True]
    assert np.isfinite(many.fn_peak_N[0]) and np.isnan(many.fn_peak_N[1:]).all()
    assert many.mode[1] is None and many.phases[1].size == 0 and many.error[0] is None
    assert "H = 5 m is not allowed" in many.error[1]
    assert "mu = nan is not allowed" in many.error[2]
    assert "E = -1 Pa is not allowed" in many.error[3]
    assert "3 failed" in repr(many)


@pytest.mark.parametrize(
    "keys, sentence",
    [
        ({"mu": [0.1, 0.2], "e": [1, 1, 1]}, "these shapes cannot be broadcast together: mu (2,), e (3,)"),
        ({"mu": ["a", "b"]}, "mu = ['a', 'b'] is not allowed: mu must be a number or numbers"),
        ({"e": 2}, "e = 2 is not allowed: e must be in [0.001, 1]"),
        ({"threads": 0}, "threads = 0 is not allowed"),
        ({"mu": ["a"] * 1000}, "'a', '... is not allowed: mu must be a number or numbers"),
        ({"lengths": [[0.4, 0.4]]}, "lengths must be the length of each link"),
        ({"lengths": [0.4, 0.5], "links": 2}, "lengths cannot be combined with links or length"),
        ({"lengths": [0.4, 0.5], "length": "H / 2"}, "lengths cannot be combined with links or length"),
        ({"integrator": ["euler"]}, 'integrator = "euler" is not allowed'),
    ],
)
def test_an_error_in_all_points_is_a_value_error(keys, sentence):
    with pytest.raises(ValueError) as error:
        oblique.solve_many(**{"H": 1, "mu": 0.4, "e": 1, **keys})
    assert sentence in str(error.value)


def test_masked_values_fail_alone():
    mu = np.ma.array([0.2, 0.4, 0.6], mask=[False, True, False])
    many = oblique.solve_many(1, mu, 1)
    assert many.failed.tolist() == [False, True, False]
    assert "mu = nan is not allowed" in many.error[1]
    whole = np.ma.array([1, 1, 0], mask=[False, True, False])
    assert oblique.solve_many(1, whole, 1).failed.tolist() == [False, True, False]
    assert oblique.solve_many(1, [mu, whole], 1).failed.tolist() == [[False, True, False]] * 2
    assert oblique.solve_many(1, 0.4, 1, k=np.ma.array([1e7, 2e7], mask=[True, False])).failed[0]


def test_missing_values_of_pandas_fail_alone():
    pandas = pytest.importorskip("pandas")
    for values in (pandas.array([0.4, None], dtype="Float64"), pandas.Series([1, None], dtype="Int64")):
        assert oblique.solve_many(1, values, 1).failed.tolist() == [False, True]
    rows = pandas.DataFrame({"H": [1, 0.9], "mu": [0.2, 0.4], "e": [1, 0.9]}, index=[5, 6])
    assert oblique.solve_many(**rows).shape == (2,)


def test_progress_is_reported_to_the_end_and_may_stop_the_work():
    reported = []
    mu = np.linspace(0, 1, 500)
    one = oblique.solve_many(1, mu, 1, progress=lambda *counts: reported.append(counts), threads=np.int64(1))
    assert reported == sorted(reported) and reported[-1] == (500, 500)
    assert np.array_equal(one.fn_peak_N, oblique.solve_many(1, mu, 1, threads=3).fn_peak_N)

    def enough(done, of):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        oblique.solve_many(1, np.linspace(0, 1, 100_000), 1, progress=enough)


def test_progress_may_solve_and_query():
    inner = []
    oblique.solve_many(
        1, np.linspace(0, 1, 500), 1, progress=lambda *_: inner.append(oblique.solve(1, 0.4, 1).mu)
    )
    assert set(inner) == {0.4}


def test_fields_are_accessible_by_name():
    many = oblique.solve_many(1, [0.4, 1.2], 1)
    assert many["fn_peak_N"] is many.fn_peak_N and many["energy"]["closure"] is many.energy.closure
    assert many["fn_peaks_N"] is many.fn_peaks_N
    assert oblique.solve(1, 0.4, 1)["fn_peak_N"] == many["fn_peak_N"][0]
    assert oblique.trace(1, 0.4, 1)["state"][0] == "sC"
    with pytest.raises(KeyError, match="no field 'fn': there are H, mu"):
        many["fn"]


def test_errors_are_estimated_on_request():
    assert np.isnan(oblique.solve_many(1, [0.4], 1, elements_per_link=2).errors.fn_peak).all()
    many = oblique.solve_many(1, [0.4], 1, elements_per_link=2, errors=True)
    one = oblique.solve(1, 0.4, 1, elements_per_link=2, errors=True)
    assert many.errors.fn_peak[0] == one.errors.fn_peak > 0


def test_ragged_lists_are_parts_of_one_array():
    many = oblique.solve_many(1, [0.4, -1, 1.2], 1)
    for name in ("fn_peaks_N", "major_peaks_N", "phases", "stick_intervals_s"):
        values, offsets = many.ragged(name)
        assert len(offsets) == 4 and offsets[1] == offsets[2] and offsets[3] == len(values)
        assert np.array_equal(values[offsets[2] :], getattr(many, name)[2])
    with pytest.raises(ValueError, match="'mode' is no list: lists are fn_peaks_N"):
        many.ragged("mode")
    with pytest.raises(AttributeError, match="fn_peak_N"):
        many.fn_pk


def test_a_table_for_pandas_has_the_names_of_queries():
    table = oblique.solve_many(1, [0.4, 1.2], 1).to_pandas()
    assert list(table.columns)[:4] == ["H", "mu", "e", "fall_time_s"]
    assert table["closure"].max() < 1e-6 and table["solver_version"][0] == oblique.__version__
