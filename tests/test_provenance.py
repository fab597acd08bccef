"""Which commit a report names."""

import depthwalk
from depthwalk.provenance import commit


def test_commit_is_that_of_our_own_checkout_only(tmp_path, monkeypatch):
    monkeypatch.setattr(depthwalk, "__file__", str(tmp_path / "depthwalk" / "__init__.py"))
    assert commit() is None
