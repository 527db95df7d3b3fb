"""Call the function of palpate that the rule names; kernels alone use the threads of the rule, libraries use one."""

import os

os.environ |= {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
os.environ["NUMBA_NUM_THREADS"] = str(snakemake.threads)

from palpate.run.job import call, kernel_cache

os.environ["NUMBA_CACHE_DIR"] = str(kernel_cache())
call(snakemake)
