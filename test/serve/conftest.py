# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A server for the tests of a file; without what it needs, all of this folder is left out."""

import pytest

for needed in ('fastapi', 'uvicorn', 'python_multipart', 'sqlalchemy'):
    pytest.importorskip(needed, reason="the server is an extra: pip install 'weld-twin[serve]'")


@pytest.fixture(scope='module')
def server(tmp_path_factory):
    from served import Server

    made = Server(tmp_path_factory.mktemp('served'))
    yield made
    made.kill()
