# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Rows of two published tables, read as their authors wrote them, against plain arithmetic."""

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core import DataError, catalog, diagnose
from weld_twin_core.effects import REGISTRY
from weld_twin_msgs_py.bags import read_recording, write_recording
from weld_twin_msgs_py.tables import TableOptions, read_table

DATA = Path(__file__).parent / 'data'


def cells(name, delimiter):
    with (DATA / name).open(newline='') as file:
        rows = list(csv.DictReader(file, delimiter=delimiter))
    return {key: np.array([float(row[key].replace(',', '.')) for row in rows]) for key in rows[0]}


@pytest.fixture(scope='module')
def ur5():
    return read_table(DATA / 'ur5_sample.csv', catalog.load('ur5'))


@pytest.fixture(scope='module')
def ur10():
    return read_table(DATA / 'ur10_sample.csv', catalog.load('ur10'))


def test_the_ur5_is_measured_at_target_plus_difference(ur5):
    raw = cells('ur5_sample.csv', ',')
    for k, axis in enumerate('xyz'):
        wanted = 1e-3 * (raw[f'{axis}_t'] + raw[f'{axis}_dif'])
        np.testing.assert_allclose(ur5.recording.measured.position[:, k], wanted, atol=1e-12)
    for k in range(6):
        wanted = np.deg2rad(raw[f'joint_{k + 1}'])
        np.testing.assert_allclose(ur5.recording.joints.q[:, k], wanted, atol=1e-12)
    assert ur5.recording.measured.rotation is None


def test_the_ur10_has_decimal_commas_millimetres_and_intrinsic_angles(ur10):
    raw = cells('ur10_sample.csv', ';')
    measured = ur10.recording.measured
    angles = np.stack([raw[f'measurement_r{axis}'] for axis in 'xyz'], axis=1)
    wanted = Rotation.from_euler('XYZ', angles, degrees=True).as_matrix()
    np.testing.assert_allclose(measured.rotation, wanted, atol=1e-12)
    for k, axis in enumerate('xyz'):
        np.testing.assert_allclose(
            measured.position[:, k], 1e-3 * raw[f'measurement_{axis}'], atol=1e-12
        )
    temperature = ur10.recording.temperature.value
    np.testing.assert_allclose(temperature, raw['measurement_temperature'])
    sigma = np.sqrt(np.mean([raw[f'measurement_std_{a}'] ** 2 for a in 'xyz'], axis=0)) * 1e-3
    np.testing.assert_allclose(measured.sigma, sigma, rtol=1e-12)


@pytest.mark.parametrize(
    ('name', 'words'),
    [
        ('ur5', ['plus difference', 'degrees', 'in mm', 'no stamps']),
        ('ur10', ["separated by ';'", 'decimal', 'XYZ', 'do not increase', 'degC', 'in mm']),
    ],
)
def test_every_guess_is_put_into_words(name, words, request):
    said = ' | '.join(request.getfixturevalue(name).assumptions)
    for word in words:
        assert word in said


def test_the_rounded_stamps_leave_the_order_of_the_rows(ur10):
    np.testing.assert_array_equal(ur10.recording.measured.t, np.arange(60.0))


def test_two_tables_without_a_date_do_not_share_one(ur5, ur10):
    first, last = ur5.recording.span_ns
    other = ur10.recording.span_ns
    assert last < other[0] or other[1] < first


def test_the_sign_of_the_difference_is_the_users():
    raw = cells('ur5_sample.csv', ',')
    options = TableOptions(difference='subtract')
    recording, _ = read_table(DATA / 'ur5_sample.csv', catalog.load('ur5'), options)
    expected = 1e-3 * (raw['x_t'] - raw['x_dif'])
    np.testing.assert_allclose(recording.measured.position[:, 0], expected, atol=1e-15)


def test_an_imported_table_survives_the_bag(ur10, tmp_path):
    robot, recording = catalog.load('ur10'), ur10.recording
    write_recording(tmp_path / 'bag', recording, robot)
    back = read_recording(tmp_path / 'bag', robot)
    assert back.joints.static
    np.testing.assert_array_equal(back.measured.position, recording.measured.position)
    np.testing.assert_allclose(back.measured.rotation, recording.measured.rotation, atol=1e-14)
    np.testing.assert_allclose(back.measured.sigma, recording.measured.sigma, rtol=1e-14)
    np.testing.assert_array_equal(back.temperature.value, recording.temperature.value)


def test_blank_lines_before_the_header_do_not_matter(ur5, tmp_path):
    (tmp_path / 'late.csv').write_text('\n' * 40 + (DATA / 'ur5_sample.csv').read_text())
    late, _ = read_table(tmp_path / 'late.csv', catalog.load('ur5'))
    np.testing.assert_array_equal(late.measured.position, ur5.recording.measured.position)


def test_a_column_that_is_not_there_lists_those_there_are():
    options = TableOptions(position_columns=('x', 'y', 'z'))
    with pytest.raises(DataError, match=r"no column 'x'; its columns are .*, x_t, y_t"):
        read_table(DATA / 'ur5_sample.csv', catalog.load('ur5'), options)


@pytest.mark.slow
def test_sixty_poses_of_a_real_arm_shrink_by_geometry(ur10):
    """Both arms, whole: `weld-twin lab real-arms`."""
    robot, align = catalog.load('ur10'), frozenset({'base', 'tool'})
    others = REGISTRY.keys() - {'joint_offset', 'link_length', 'link_offset', 'link_twist'}
    found = diagnose([ur10.recording], robot, align=align, exclude=others, experiment=False)
    assert found.shrink.ratio < 0.8
    assert found.gap.noise_floor_m < 0.5 * found.gap.rms_m
