"""OpenCRG files by an independent writer, in all four formats."""

import numpy as np
import pytest

from engine_mount.signals.roads.crg import FORMATS
from engine_mount.signals.roads.table import road_profile
from engine_mount.signals.signal import SignalError

INCREMENT = 0.02
V = np.array([-1.5, -0.5, 0.0, 1.5])
ROWS = 1200


def grid(seed=3, rows=ROWS):
    """Heights (rows, 4) in m: a walk along the road, the tracks apart."""
    random = np.random.default_rng(seed)
    return 0.01 * np.cumsum(random.normal(0.0, 0.02, (rows, V.size)), axis=0) + 0.001 * random.normal(
        0.0, 1.0, (rows, V.size)
    )


def refusal(path, **how):
    with pytest.raises(SignalError) as caught:
        road_profile(path, **how)
    return str(caught.value)


@pytest.mark.parametrize('kind', FORMATS)
@pytest.mark.parametrize('named', [True, False])
def test_a_track_comes_back_from_each_format(tmp_path, write_crg, kind, named):
    heights = grid()
    v = V if named else np.array([-1.5, -0.5, 0.5, 1.5])
    path = write_crg(tmp_path / 'made.crg', heights, INCREMENT, v, kind, named=named)
    profile = road_profile(path, lateral=-0.5)
    np.testing.assert_allclose(profile.height, heights[:, 1], atol=1e-9 if 'D' in kind else 1e-7)
    np.testing.assert_allclose(profile.distance, INCREMENT * np.arange(ROWS), atol=1e-9)
    assert profile.provenance.format == 'OpenCRG'
    assert len(profile.provenance.sha256) == 64


def test_more_channels_than_a_record_holds_are_wrapped(tmp_path, write_crg):
    v = np.round(np.linspace(-1.1, 1.1, 23), 3)
    heights = np.column_stack([grid()[:, 0] + 0.1 * place for place in v])
    for kind in FORMATS:
        path = write_crg(tmp_path / f'{kind}.crg', heights, INCREMENT, v, kind)
        np.testing.assert_allclose(road_profile(path, lateral=v[17]).height, heights[:, 17], atol=1e-6)


def test_between_two_tracks_the_height_is_linear(tmp_path, write_crg):
    heights = grid()
    path = write_crg(tmp_path / 'made.crg', heights, INCREMENT, V, 'KDBI')
    wanted = 0.75 * heights[:, 2] + 0.25 * heights[:, 3]
    np.testing.assert_allclose(road_profile(path, lateral=0.375).height, wanted, atol=1e-12)
    assert 'its long sections are at -1.5 .. 1.5 m' in refusal(path, lateral=1.6)


def test_slope_and_banking_are_in_the_heights_and_told(tmp_path, write_crg):
    heights, rows = grid(), np.arange(ROWS)
    slope = np.where(rows > 0, 0.02 * np.sin(0.01 * rows), 9.0)  # what stands in the first row is unused
    banking = np.full(ROWS, 0.03)
    reference = {'phi': np.where(rows > 0, 0.001 * rows, np.nan), 'slope': slope, 'banking': banking}
    path = write_crg(tmp_path / 'made.crg', heights, INCREMENT, V, 'LDFI', reference=reference)
    profile = road_profile(path, lateral=-1.5)
    slope[0] = 0.0
    wanted = heights[:, 0] + INCREMENT * np.cumsum(slope) - 1.5 * 0.03
    np.testing.assert_allclose(profile.height, wanted, atol=1e-9)
    told = ' '.join(profile.notes)
    for words in ('slope of the reference line, up to 0.02 m/m', 'banking, up to 0.03', 'heading is ignored'):
        assert words in told


def test_missing_heights_are_interpolated_where_few_and_refused_where_many(tmp_path, write_crg):
    heights = grid()
    heights[:3] = heights[-2:] = heights[500:510] = np.nan
    path = write_crg(
        tmp_path / 'made.crg', heights, INCREMENT, V, 'KRBI', head={'REFERENCE_LINE_END_U': 23.9}
    )
    profile = road_profile(path)
    assert profile.distance[0] == pytest.approx(0.06)
    assert np.isfinite(profile.height).all()
    told = ' '.join(profile.notes)
    assert 'missing heights at the ends are left out' in told
    assert '1 gaps are interpolated, the longest of 0.22 m at 9.98 m' in told
    heights[500:540] = np.nan
    path = write_crg(tmp_path / 'worse.crg', heights, INCREMENT, V, 'LRFI')
    assert 'no heights from 9.98 to 10.8 m (0.82 m; 1 gaps in all)' in refusal(path)


def test_a_file_that_is_cut_off_or_converted_is_refused(tmp_path, write_crg):
    path = write_crg(tmp_path / 'made.crg', grid(), INCREMENT, V, 'KRBI')
    whole = path.read_bytes()
    path.write_bytes(whole[:-200])
    assert 'were line ends converted on its way?' in refusal(path)
    path.write_bytes(whole[: -80 * 20])
    assert 'but REFERENCE_LINE_END_U is 23.98 m; is the file cut off?' in refusal(path)
    path.write_bytes(whole[: whole.index(b'#:')])
    assert 'the file ends within section $KD_DEFINITION' in refusal(path)
    text = write_crg(tmp_path / 'text.crg', grid(), INCREMENT, V, 'LRFI')
    lines = text.read_text('latin-1').splitlines()
    lines[-3] = lines[-3][:12] + 'x' + lines[-3][13:]
    text.write_text('\n'.join(lines), 'latin-1')
    assert f'text.crg, line {len(lines) - 2}: ' in refusal(text)


def test_a_file_without_heights_is_refused_with_the_one_that_it_refers_to(tmp_path):
    master = tmp_path / 'master.crg'
    master.write_text(
        '$CT\nby reference\n$\n$ROAD_CRG_FILE\n* a comment\n  ma\n  de.crg  ! in two lines\n$\n'
    )
    assert 'no table of heights: give the file that it refers to, made.crg' in refusal(master)
    master.write_text('$CT\nnothing\n$\n')
    assert 'no table of heights' in refusal(master)


def test_a_scale_of_the_heights_is_refused_and_other_modifiers_do_no_harm(tmp_path, write_crg):
    harmless = {'ROAD_CRG_MODS': {'REFPOINT_X': 3, 'SCALE_SLOPE': 1.0}}
    assert (
        road_profile(write_crg(tmp_path / 'a.crg', grid(), INCREMENT, V, more=harmless)).height.size == ROWS
    )
    scaled = {'ROAD_CRG_MODS': {'SCALE_Z_GRID': 2.0}}
    words = refusal(write_crg(tmp_path / 'b.crg', grid(), INCREMENT, V, more=scaled))
    assert 'SCALE_Z_GRID in $ROAD_CRG_MODS changes the heights' in words


def test_heights_in_another_unit_or_of_another_kind_are_refused(tmp_path, write_crg):
    path = write_crg(tmp_path / 'made.crg', 1000.0 * grid(), INCREMENT, V, 'KDBI')
    assert 'rougher than any road' in refusal(path)
    assert 'are they in mm' in refusal(path)
    text = write_crg(tmp_path / 'mu.crg', grid(), INCREMENT, V, 'LRFI')
    text.write_bytes(text.read_bytes().replace(b'0.000,m ', b'0.000,1 '))
    assert 'channels must be long sections in m' in refusal(text)
    text.write_bytes(text.read_bytes().replace(b'#:LRFI', b'#:LRBI'))
    assert 'in format LRBI are not read' in refusal(text)
