from setuptools import find_packages, setup

NAME = "pendulum_bridge"
EXECUTABLES = {"rig_emulator": "pendulum_bridge.emulator.rig_emulator:main"}

setup(
    name=NAME,
    version="0.1.0",
    description="The rig's side: wire protocol, limits, excitation, and an emulated rig on MuJoCo",
    license="Apache-2.0",
    packages=find_packages(exclude=["test", "test.*"]),
    python_requires=">=3.12",
    install_requires=["mujoco", "numpy", "PyYAML", "rosbags"],
    entry_points={"console_scripts": [f"{name} = {function}" for name, function in EXECUTABLES.items()]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"lib/{NAME}", [f"lib/{name}" for name in EXECUTABLES]),
    ],
)
