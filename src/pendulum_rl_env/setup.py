import runpy
from pathlib import Path

from setuptools import find_packages, setup

NAME = "pendulum_rl_env"
EXECUTABLES = {
    "train": "pendulum_rl_env.programs:run_train",
    "evaluate": "pendulum_rl_env.programs:run_evaluate",
}
VERSION = runpy.run_path(str(Path(__file__).resolve().parent / NAME / "version.py"))["__version__"]

setup(
    name=NAME,
    version=VERSION,
    description="Gymnasium environments on the twin or the rig, and learning on them",
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
    package_data={NAME: ["presets/*.yaml", "py.typed"]},
    python_requires=">=3.12",
    install_requires=["gymnasium", "matplotlib", "numba", "numpy", "pillow", "PyYAML", "scipy"],
    extras_require={
        "test": ["hypothesis", "pytest"],
        "learning": [
            "onnx",
            "onnxruntime",
            "optuna",
            "safetensors",
            "sb3-contrib",
            "stable-baselines3",
            "tensorboard",
            "torch",
        ],
        "video": ["imageio-ffmpeg", "moviepy", "pygame"],
    },
    entry_points={
        "console_scripts": [f"{name} = {function}" for name, function in EXECUTABLES.items()],
        "gymnasium.envs": [f"__root__ = {NAME}.registration:register_environments"],
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"lib/{NAME}", [f"lib/{name}" for name in EXECUTABLES]),
    ],
)
