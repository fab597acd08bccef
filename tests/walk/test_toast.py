import pytest

from depthwalk.walk.toast import Toast


def test_a_long_message_is_shown_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr("depthwalk.walk.toast.time.monotonic", lambda: now[0])
    toast = Toast()
    for message, seconds in (("Flying", 4), ("a mistake " * 15, 10)):
        toast.show(message)
        now[0] += seconds - 0.1
        assert toast.text == message
        now[0] += 0.2
        assert not toast.text and toast.message == message
