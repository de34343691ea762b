#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Runs a command with the module of a sanitizer preset: tools/sanitized.sh asan|tsan command …
# Python itself is not instrumented, so the sanitizer's runtime must be there before it starts.
set -euo pipefail
cd "$(dirname "$0")/.."
preset="$1"; shift
export AFTERGLOW_PRESET="$preset" AFTERGLOW_LIBRARY="$PWD/build/$preset/python" AFTERGLOW_SANITIZER="$preset"
case "$preset" in
  asan)
    # Leaks of Python and numpy at exit are theirs, and many; what we leak, a test of our own counts.
    export ASAN_OPTIONS="detect_leaks=0:abort_on_error=1:detect_odr_violation=0"
    export UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1"
    export LD_PRELOAD="$(g++ -print-file-name=libasan.so) $(g++ -print-file-name=libubsan.so) $(g++ -print-file-name=libstdc++.so)" ;;
  tsan)
    export TSAN_OPTIONS="suppressions=$PWD/tests/tsan.supp:halt_on_error=1:ignore_noninstrumented_modules=1:history_size=7"
    export LD_PRELOAD="$(g++ -print-file-name=libtsan.so) $(g++ -print-file-name=libstdc++.so)" ;;
  *) echo "tools/sanitized.sh: asan or tsan" >&2; exit 2 ;;
esac
exec "$@"
