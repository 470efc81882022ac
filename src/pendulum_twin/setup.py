import runpy
from pathlib import Path

from setuptools import find_packages, setup

NAME = "pendulum_twin"
EXECUTABLES = {
    "twin_node": "pendulum_twin.nodes.twin_node:main",
    "twin_urdf": "pendulum_twin.urdf:main",
}
VERSION = runpy.run_path(str(Path(__file__).resolve().parent / NAME / "version.py"))["__version__"]

setup(
    name=NAME,
    version=VERSION,
    description="Digital twin of a cart-pendulum rig: "
    "measured constants, believed effects, compiled kernel",
    long_description=(Path(__file__).resolve().parent / "README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    author="The pendulum maintainers",
    author_email="maintainers@pendulum.invalid",
    maintainer="The pendulum maintainers",
    maintainer_email="maintainers@pendulum.invalid",
    url="https://pendulum.invalid/pendulum",
    license="Apache-2.0",
    license_files=["LICENSE"],
    packages=find_packages(exclude=["test", "test.*"]),
    package_data={NAME: ["py.typed", "nodes/loopback.xml"]},
    python_requires=">=3.12",
    install_requires=["argcomplete", "mcap", "numba", "numpy", "PyYAML", "rosbags"],
    extras_require={"frames": ["pandas"], "test": ["hypothesis", "pytest"]},
    entry_points={
        "console_scripts": [f"{name} = {function}" for name, function in EXECUTABLES.items()]
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"lib/{NAME}", [f"lib/{name}" for name in EXECUTABLES]),
    ],
)
