from pathlib import Path

from setuptools import find_packages, setup

NAME = "pendulum_sysid"
EXECUTABLES = {"sysid": "pendulum_sysid.cli:main"}

setup(
    name=NAME,
    version="0.1.0",
    description="Diagnosis of recordings: where the twin is wrong and which physics is missing",
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
    package_data={
        "pendulum_sysid": [
            "py.typed",
            "telling/templates/*",
            "studies/proof/templates/*",
            "fleet/templates/*",
        ]
    },
    python_requires=">=3.12",
    extras_require={
        "fast": ["threadpoolctl"],
        "frames": ["pandas"],
        "rivals": ["pysindy", "scikit-learn", "torch"],
        "test": ["hypothesis", "pytest"],
        "fleet": ["dask", "distributed", "duckdb", "fsspec", "pandas", "pyarrow", "ruptures"],
    },
    install_requires=[
        "Jinja2",
        "lz4",
        "MarkupSafe",
        "matplotlib",
        "numpy",
        "rosbags",
        "scipy",
        "zstandard",
    ],
    entry_points={
        "console_scripts": [f"{name} = {function}" for name, function in EXECUTABLES.items()]
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"lib/{NAME}", [f"lib/{name}" for name in EXECUTABLES]),
    ],
)
