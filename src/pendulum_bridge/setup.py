from glob import glob
from pathlib import Path

from setuptools import find_packages, setup

NAME = "pendulum_bridge"
EXECUTABLES = {
    "driver_node": "pendulum_bridge.nodes.driver_node:main",
    "excitation_node": "pendulum_bridge.nodes.excitation_node:main",
    "recorder_node": "pendulum_bridge.nodes.recorder_node:main",
    "view_node": "pendulum_bridge.nodes.view_node:main",
    "watch_node": "pendulum_bridge.nodes.watch_node:main",
    "rig_doctor": "pendulum_bridge.doctor.rig_doctor:main",
    "rig_emulator": "pendulum_bridge.emulator.rig_emulator:main",
}
SHARED = ("launch", "config", "rviz", "foxglove")

setup(
    name=NAME,
    version="0.1.0",
    description=(
        "The rig's side: driver, excitation, recorder, doctor, view, and an emulated rig on MuJoCo"
    ),
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
    package_data={NAME: ["view/static/*"]},
    python_requires=">=3.12",
    install_requires=[
        "aiohttp",
        "lz4",
        "mcap",
        "mujoco",
        "numpy",
        "PyYAML",
        "rosbags",
        "zstandard",
    ],
    extras_require={"test": ["hypothesis", "pytest"]},
    entry_points={
        "console_scripts": [f"{name} = {function}" for name, function in EXECUTABLES.items()]
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"lib/{NAME}", [f"lib/{name}" for name in EXECUTABLES]),
        *((f"share/{NAME}/{folder}", sorted(glob(f"{folder}/*"))) for folder in SHARED),
    ],
)
