# Short names for the commands of CONTRIBUTING.md. Needs `just`; nothing else needs this file.

# The two-minute check before a commit: format, lints, header, documents.
check:
    cargo fmt --check
    cargo clippy --lib -- -D warnings
    cargo test --test header --test readme

# All tests, from Rust and C.
test *ARGS:
    cargo test {{ARGS}}

# The full gate; installs missing Debian packages when run as root.
gate:
    bash .ci/run

# Regenerates include/sinew.h from src/capi.
header:
    SINEW_WRITE_HEADER=1 cargo test --test header

# A bench by name, as in `just bench touch -- --quick`; reports go to target/report/.
bench NAME *ARGS:
    cargo bench --bench {{NAME}} {{ARGS}}

# The Rust documentation, with warnings denied, and the links of all documents.
docs:
    RUSTDOCFLAGS="-D warnings" cargo doc --no-deps
    cargo test --test readme
