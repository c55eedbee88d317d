#!/usr/bin/env bash
# libFuzzer on every reader of files, one after the other:
#   search.sh BUILD CORPUS [SECONDS [TARGET ...]]
# BUILD: folder of `cmake --preset fuzzer`. CORPUS: where inputs that reach new code go, and faults (fault-*).
# SECONDS: for each target, 600. TARGETs: by the name of their input, default all. Ends with 1 where a fault was found.
set -euo pipefail
[ $# -ge 2 ] || { sed -n '2,5s/^# \{0,1\}//p' "$0" >&2; exit 2; }
program="$1/tests/fuzz_tests" corpus="$2" seconds="${3:-600}"
[ -x "$program" ] || { echo "$program: no such program; cmake --build --preset fuzzer --target fuzz_tests" >&2; exit 2; }
shift $(($# < 3 ? $# : 3))
mkdir -p "$corpus"

targets=("$@")
if [ ${#targets[@]} -eq 0 ]; then
  mapfile -t targets < <(DEGAS_FUZZ_LIST=1 "$program" '~[#harness_test]' '~[#hostile_test]' 2>/dev/null |
    grep -E '^[A-Za-z0-9][A-Za-z0-9_.-]*$')
fi
faults=0
for target in "${targets[@]}"; do
  log="$corpus/$target.log"
  if ! DEGAS_FUZZ_CORPUS="$corpus" DEGAS_FUZZ_TARGET="$target" DEGAS_FUZZ_SECONDS="$seconds" \
    ASAN_OPTIONS=detect_leaks=0:allocator_may_return_null=1 "$program" >"$log" 2>&1; then
    echo "$target: FAULT, see $log"
    faults=1
    continue
  fi
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  covered=$(grep -o 'cov: [0-9]*' "$log" | tail -1)
  echo "$target: ${runs:-0} inputs in $seconds s, ${covered:-cov: 0} edges, $(find "$corpus/$target" -type f | wc -l) kept"
done
exit $faults
