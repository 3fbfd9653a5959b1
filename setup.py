"""Packaging lives in pyproject.toml; this file names the cffi modules and
compiles their C files on all cores.
"""

import os
from concurrent.futures import ThreadPoolExecutor
from functools import partial

from setuptools import setup
from setuptools.command.build_ext import build_ext


class BuildOnAllCores(build_ext):
    """One compiler a core; setuptools alone would compile file by file."""

    def build_extensions(self):
        one_by_one = self.compiler.compile

        def compile_all(sources, *places, **options):
            alone = partial(compile_alone, places, options)
            with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as cores:
                return [o for made in cores.map(alone, sources) for o in made]

        def compile_alone(places, options, source):
            return one_by_one([source], *places, **options)

        self.compiler.compile = compile_all
        super().build_extensions()


setup(
    cmdclass={"build_ext": BuildOnAllCores},
    cffi_modules=[
        "c_ext/build_ffi.py:engine_ffi",
        "c_ext/build_ffi.py:sync_ffi",
    ],
    # cffi builds both for the limited API: one wheel for 3.11 and later
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
)
