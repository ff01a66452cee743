//! What this machine is.

/// The processor's name, as Linux tells it.
pub fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name"));
    let name = name
        .and_then(|line| line.split(':').nth(1))
        .map_or("unknown", str::trim);
    let wide = if text.contains("avx512f") { ", AVX-512" } else { "" };
    format!("{name}{wide}, one thread")
}
