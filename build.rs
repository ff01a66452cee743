//! Gives the shared library its versioned name, so that programs linked against one ABI never load another.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    // Before 1.0 every minor version may break the ABI, so it is part of the name.
    let version = concat!(env!("CARGO_PKG_VERSION_MAJOR"), ".", env!("CARGO_PKG_VERSION_MINOR"));
    match std::env::var("CARGO_CFG_TARGET_OS").as_deref() {
        Ok("macos") => println!("cargo:rustc-cdylib-link-arg=-Wl,-install_name,@rpath/libsinew.{version}.dylib"),
        Ok("windows" | "unknown") => {}
        _ => println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libsinew.so.{version}"),
    }
}
