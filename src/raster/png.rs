//! PNG output of images.

use super::picture::Image;
use crate::base::ensure;
use crate::{Error, Result};
use std::path::Path;

impl Image {
    /// Writes the image as a PNG file with eight bits per channel, sRGB.
    ///
    /// The file is first written under another name in the same folder and then renamed. A failed write leaves an
    /// existing file unchanged.
    ///
    /// # Errors
    /// [`Error::Io`] if the file could not be written. [`Error::InvalidArgument`] if there are not `width` x `height`
    /// pixels. [`Error::Unsupported`] if the crate was built without its feature `pictures`.
    pub fn write_png(&self, path: impl AsRef<Path>) -> Result<()> {
        let expected = u64::from(self.width) * u64::from(self.height);
        ensure!(
            expected != 0 && self.pixels.len() as u64 == expected,
            "{} pixels are not {} x {}",
            self.pixels.len(),
            self.width,
            self.height
        );
        write(self, path.as_ref())
    }
}

#[cfg(not(feature = "pictures"))]
fn write(_image: &Image, _path: &Path) -> Result<()> {
    Err(Error::Unsupported(
        "sinew was built without its feature pictures".into(),
    ))
}

#[cfg(feature = "pictures")]
fn write(image: &Image, path: &Path) -> Result<()> {
    let failure = |cause: &dyn std::fmt::Display| Error::Io(format!("{}: {cause}", path.display()));
    let name = path.file_name().ok_or_else(|| failure(&"not the name of a file"))?;
    let mut temporary = std::ffi::OsString::from(".");
    temporary.push(name);
    temporary.push(format!(".{}", unique()));
    let temporary = path.with_file_name(temporary);
    let written =
        encode(image, &temporary).and_then(|()| std::fs::rename(&temporary, path).map_err(png::EncodingError::from));
    written.map_err(|cause| {
        // The original error is reported, even if nothing can be removed.
        let _ = std::fs::remove_file(&temporary);
        failure(&cause)
    })
}

/// A string that no other write uses at the same time, in this or another process.
#[cfg(feature = "pictures")]
fn unique() -> String {
    use std::sync::atomic::{AtomicU32, Ordering};
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    format!("{}-{count}", std::process::id())
}

#[cfg(feature = "pictures")]
fn encode(image: &Image, path: &Path) -> std::result::Result<(), png::EncodingError> {
    let file = std::fs::OpenOptions::new().write(true).create_new(true).open(path)?;
    let mut encoder = png::Encoder::new(std::io::BufWriter::new(file), image.width, image.height);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(image.pixels.as_flattened())?;
    writer.finish()
}
