# Sourced: tests_of ARGUMENTS... runs tests, side by side where cargo-nextest is installed.
tests_of() {
  if cargo nextest --version >/dev/null 2>&1; then
    cargo nextest run --no-fail-fast --status-level slow --final-status-level fail "$@"
  else
    # Doctests run by themselves.
    local targets=(--lib --bins --tests)
    case " $* " in *' --lib '* | *' --bin '* | *' --test '*) targets=() ;; esac
    echo 'tests: cargo-nextest is not installed (cargo install --locked cargo-nextest), so cargo test runs them, more slowly'
    cargo test --quiet --no-fail-fast "${targets[@]}" "$@"
  fi
}
