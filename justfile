# Short names for the commands of CONTRIBUTING.md. Needs `just`; nothing else needs this file.

# The two-minute check before a commit: format, lints, header, documents.
check:
    cargo fmt --check
    cargo clippy --lib -- -D warnings
    cargo test --test project -- header:: readme:: layering:: words::

# The tests, from Rust and C, without the long ones.
test *ARGS:
    cargo test {{ARGS}}

# The unit tests in src, for which the library is compiled once more.
unit *ARGS:
    cargo test --lib {{ARGS}}

# The long tests alone.
long *ARGS:
    cargo test {{ARGS}} -- --ignored

# The full gate; installs missing Debian packages when run as root.
gate:
    bash .ci/run

# Regenerates include/sinew.h from src/capi.
header:
    SINEW_WRITE_HEADER=1 cargo test --test project header::

# A bench by name, as in `just bench touch -- --quick`; reports go to target/report/.
bench NAME *ARGS:
    cargo bench --bench {{NAME}} {{ARGS}}

# State hashes of many scenes against those of a commit, for changes that must not change results.
hashes COMMIT *SCENE:
    bash .ci/hashes {{COMMIT}} {{SCENE}}

# The Rust documentation, with warnings denied, and the links of all documents.
docs:
    RUSTDOCFLAGS="-D warnings" cargo doc --no-deps
    cargo test --test project readme::
