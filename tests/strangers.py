"""Installed packages of others, as the tests make them."""


def install(folder, package="somebody", **controllers):
    """Describe a package in a folder that registers controllers: ``module:factory`` by name."""
    described = folder / f"{package}-1.0.dist-info"
    described.mkdir()
    metadata = f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n"
    (described / "METADATA").write_text(metadata)
    lines = [f"{name} = {reference}\n" for name, reference in controllers.items()]
    registered = "".join(("[defmanip_gym.controllers]\n", *lines))
    (described / "entry_points.txt").write_text(registered)
