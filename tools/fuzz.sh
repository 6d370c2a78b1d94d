#!/usr/bin/env bash
# Fuzzes each target for some seconds: tools/fuzz.sh [--from-seeds] SECONDS [TARGET...]
#
# What is found is kept in fuzz/corpus and is the start of the next run; with --from-seeds every run
# starts from fuzz/seeds and keeps nothing. An input that fails is written to fuzz/artifacts.
#
# The targets are those of `cargo fuzz`; this needs neither it nor a nightly compiler, because
# coverage counters are a pass of the code generator that the stable one has as well.
set -eu
cd "$(dirname "$0")/../fuzz"

keep=yes
if [ "${1:-}" = --from-seeds ]; then
  keep=no
  shift
fi
seconds=$1
shift
targets=("$@")
if [ ${#targets[@]} -eq 0 ]; then
  for file in fuzz_targets/*.rs; do
    targets+=("$(basename "$file" .rs)")
  done
fi

if ! command -v "${CXX:-c++}" >/dev/null; then
  echo "error: libFuzzer needs a C++ compiler; on Debian and Ubuntu: sudo apt-get install g++" >&2
  exit 1
fi

host=$(rustc -vV | sed -n 's/^host: //p')
# With --target the flags do not reach build scripts, which cannot be linked with them.
RUSTFLAGS="--cfg fuzzing -Cpasses=sancov-module -Ccodegen-units=1
  -Cllvm-args=-sanitizer-coverage-level=4
  -Cllvm-args=-sanitizer-coverage-inline-8bit-counters
  -Cllvm-args=-sanitizer-coverage-pc-table
  -Cllvm-args=-sanitizer-coverage-trace-compares" \
  CARGO_TARGET_DIR=target cargo build --locked --release --target "$host"

log=$(mktemp)
trap 'rm -rf "$log" "${corpus:-}"' EXIT
for name in "${targets[@]}"; do
  if [ $keep = yes ]; then
    folder=corpus/$name
    mkdir -p "$folder"
  else
    corpus=$(mktemp -d)
    folder=$corpus
  fi
  mkdir -p "artifacts/$name"
  if ! "target/$host/release/$name" "$folder" "seeds/$name" -max_total_time="$seconds" \
    -timeout=10 -max_len=4096 -artifact_prefix="artifacts/$name/" -print_final_stats=1 \
    -verbosity=0 >"$log" 2>&1; then
    cat "$log" >&2
    echo "error: $name fails; its input is in fuzz/artifacts/$name, run it again with" >&2
    echo "  fuzz/target/$host/release/$name FILE" >&2
    exit 1
  fi
  runs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  echo "$name: $runs inputs in $seconds s"
  rm -rf "${corpus:-}"
done
