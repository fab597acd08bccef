"""Tell how to install the optional libraries, the extras of pyproject.toml, as depthwalk itself is installed."""

from importlib import metadata
from pathlib import Path

_CHECKOUT = Path(__file__).resolve().parent.parent.parent


def install_command(extra: str, checkout: Path = _CHECKOUT) -> str:
    """Return the command that installs an extra, to be copied from a message into a terminal.

    depthwalk is on no package registry, so `pip install "depthwalk[las]"` would find nothing, or what somebody else has
    given this name. From a checkout the command is that of the README, with the checkout's path, so that it works in
    every folder. Where there is none, since a wheel was installed, it names the libraries of the extra themselves.

    Parameters
    ----------
    extra
        The name of the extra: "cluster", "fast", "gltf", "las" or "usd".
    checkout
        The folder that would be the checkout.

    Returns
    -------
    str
        The command, without quotation marks or backticks around it.
    """
    if (checkout / "pyproject.toml").is_file():
        return f'pip install -e "{checkout}[{extra}]"'
    return "pip install " + " ".join(f'"{requirement}"' for requirement in _requirements(extra))


def _requirements(extra: str) -> list[str]:
    """Return the requirements of an extra as pip takes them, from the metadata of the installed package."""
    pairs = (requirement.partition(";") for requirement in metadata.requires("depthwalk") or ())
    return [name.strip() for name, _, marker in pairs if marker.replace("'", '"').strip() == f'extra == "{extra}"']
