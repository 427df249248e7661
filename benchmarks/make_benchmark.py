"""Make the frozen suite of the benchmark anew: writes the archive and prints its hash.

A suite that has been published is never made again under the same name: this is for the next version.
"""

from pathlib import Path

import farm_ar.benchmark
from farm_ar.benchmark.frozen import NAME, made_suite
from farm_ar.benchmark.suite import pack

if __name__ == "__main__":
    suite = made_suite()
    path = Path(farm_ar.benchmark.__file__).with_name(f"{NAME}.jsonl.xz")
    pack(suite, path)
    print(f'DIGEST = "{suite.digest}"  # {path}, {path.stat().st_size} bytes')
