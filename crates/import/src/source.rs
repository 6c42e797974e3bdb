//! Where bytes come from: a file, standard input, or a slice of a dropped file in the page.

/// Reading stopped before the end of the file.
#[derive(Clone, Debug, thiserror::Error, PartialEq, Eq)]
#[error("{message}")]
pub struct ReadError {
    /// What the system said.
    pub message: String,
}

/// Bytes, read in slices: natively a file or standard input, in the page a dropped file.
#[allow(clippy::len_without_is_empty, reason = "a stream does not know whether it is empty")]
pub trait ByteSource {
    /// Fill `buf` from its start with the next bytes; how many there were, 0 at the end.
    ///
    /// # Errors
    /// [`ReadError`] when the system refuses.
    fn read(&mut self, buf: &mut [u8]) -> Result<usize, ReadError>;
    /// Number of bytes in all, if known.
    fn len(&self) -> Option<u64>;
}

/// Any [`std::io::Read`] as a source.
#[derive(Debug)]
pub struct IoSource<R> {
    reader: R,
    length: Option<u64>,
}

impl<R: std::io::Read> IoSource<R> {
    /// Read from `reader`, which holds `length` bytes if that is known.
    pub fn new(reader: R, length: Option<u64>) -> Self {
        Self { reader, length }
    }
}

impl<R: std::io::Read> ByteSource for IoSource<R> {
    fn read(&mut self, buf: &mut [u8]) -> Result<usize, ReadError> {
        loop {
            match self.reader.read(buf) {
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                other => return other.map_err(|e| ReadError { message: e.to_string() }),
            }
        }
    }
    fn len(&self) -> Option<u64> {
        self.length
    }
}
