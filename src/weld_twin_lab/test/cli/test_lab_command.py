# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""`weld-twin lab` knows every proof, and the older ones answer there as they do alone."""

import pytest

from weld_twin_lab.cli import lab
from weld_twin_nodes.cli import main


def test_older_proofs_answer_under_lab():
    assert {'benchmark', 'blind', 'campaign'} <= set(lab.PROOFS)


def test_every_proof_tells_what_it_does(capsys):
    for name in lab.PROOFS:
        with pytest.raises(SystemExit) as left:
            main(['lab', name, '--help'])
        assert left.value.code == 0
        shown = capsys.readouterr().out
        assert f'weld-twin lab {name}' in shown and len(shown.splitlines()) > 4


def test_an_older_proof_fails_under_lab_as_it_does_alone(capsys, tmp_path):
    words = ['blind', 'diagnose', 'nobody', '--out', str(tmp_path / 'out')]
    codes, said = [], []
    for start in ([], ['lab']):
        codes.append(main([*start, *words]))
        said.append(capsys.readouterr().err)
    assert codes == [2, 2]
    assert said[0] == said[1] and 'nobody' in said[0]


def test_no_proof_named_is_a_usage_error(capsys):
    with pytest.raises(SystemExit) as left:
        main(['lab'])
    assert left.value.code == 2 and 'PROOF' in capsys.readouterr().err
