"""The option --cluster: what it may say."""

import pytest

from depthwalk.cluster.address import ClusterAddress, parse_cluster
from depthwalk.errors import InputError


@pytest.mark.parametrize(
    ("text", "address"),
    [
        (None, None),
        ("local", ClusterAddress()),
        ("local:3", ClusterAddress(workers=3)),
        ("tls://farm.example:8000", ClusterAddress(url="tls://farm.example:8000")),
        ("tls://10.0.0.1", ClusterAddress(url="tls://10.0.0.1:8786")),
        ("tls://[::1]:9", ClusterAddress(url="tls://[::1]:9")),
    ],
)
def test_addresses(text: str | None, address: ClusterAddress | None) -> None:
    assert parse_cluster(text) == address


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("tcp://farm:8786", "not encrypted"),
        ("local:0", "1 to 256"),
        ("local:9999", "1 to 256"),
        ("tls://farm:0", "1 to 65535"),
        ("tls://farm:80x", "must be local"),
        ("tls://a b", "must be local"),
        ("", "must be local"),
    ],
)
def test_what_is_refused(text: str, why: str) -> None:
    with pytest.raises(InputError, match=why) as error:
        parse_cluster(text)
    assert str(error.value).startswith(f"--cluster {text}: ")
