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

/// Bytes that can be read from any place: a native file, a dropped file in the page, an unpacked member of an archive.
pub trait Source {
    /// File name, with the folders above it where files were dropped as a folder.
    fn name(&self) -> &str;
    /// Number of bytes.
    fn len(&self) -> u64;
    /// Whether there is nothing in it.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Fill `buf` from its start with the bytes at `offset`; how many there were, fewer than asked for only at the end.
    ///
    /// # Errors
    /// [`ReadError`] when the system refuses.
    fn read_at(&mut self, offset: u64, buf: &mut [u8]) -> Result<usize, ReadError>;
}

/// Bytes in memory as a source.
#[derive(Clone, Debug, Default)]
pub struct MemorySource {
    name: String,
    bytes: Vec<u8>,
}

impl MemorySource {
    /// A source of that name.
    pub fn new(name: &str, bytes: Vec<u8>) -> Self {
        Self { name: name.to_owned(), bytes }
    }
}

impl Source for MemorySource {
    fn name(&self) -> &str {
        &self.name
    }
    fn len(&self) -> u64 {
        self.bytes.len() as u64
    }
    fn read_at(&mut self, offset: u64, buf: &mut [u8]) -> Result<usize, ReadError> {
        let from = usize::try_from(offset).map_or(self.bytes.len(), |o| o.min(self.bytes.len()));
        let count = buf.len().min(self.bytes.len() - from);
        buf[..count].copy_from_slice(&self.bytes[from..from + count]);
        Ok(count)
    }
}

/// Anything that reads and seeks, such as a native file, as a source.
#[derive(Debug)]
pub struct SeekSource<R> {
    name: String,
    length: u64,
    reader: R,
}

impl<R: std::io::Read + std::io::Seek> SeekSource<R> {
    /// A source of that name over the whole of `reader`.
    ///
    /// # Errors
    /// [`ReadError`] when its length cannot be told.
    pub fn new(name: &str, mut reader: R) -> Result<Self, ReadError> {
        let length = reader.seek(std::io::SeekFrom::End(0)).map_err(|e| ReadError { message: e.to_string() })?;
        Ok(Self { name: name.to_owned(), length, reader })
    }
}

impl<R: std::io::Read + std::io::Seek> Source for SeekSource<R> {
    fn name(&self) -> &str {
        &self.name
    }
    fn len(&self) -> u64 {
        self.length
    }
    fn read_at(&mut self, offset: u64, buf: &mut [u8]) -> Result<usize, ReadError> {
        let failed = |e: std::io::Error| ReadError { message: e.to_string() };
        self.reader.seek(std::io::SeekFrom::Start(offset)).map_err(failed)?;
        let mut filled = 0;
        while filled < buf.len() {
            match self.reader.read(&mut buf[filled..]) {
                Ok(0) => break,
                Ok(count) => filled += count,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => return Err(failed(e)),
            }
        }
        Ok(filled)
    }
}
