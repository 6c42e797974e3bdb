//! Formats known by their first bytes, so that a refusal names what the file is.

/// The format that a file with this beginning has, unless it may be CSV.
pub(crate) fn other_format(head: &[u8]) -> Option<&'static str> {
    const KNOWN: &[(&[u8], &str)] = &[
        (b"MDF ", "an ASAM MDF measurement (MF4 or MDF)"),
        (b"UnFinMF ", "an unfinished ASAM MDF measurement (MF4)"),
        (b"LOGG", "a Vector BLF bus log"),
        (b"ULog\x01\x12\x35", "a PX4 ULog"),
        (b"#ROSBAG", "a ROS 1 bag"),
        (b"\x89MCAP0\r\n", "an MCAP recording"),
        (b"SQLite format 3\0", "an SQLite database (perhaps a ROS 2 bag)"),
        (b"PK\x03\x04", "a ZIP archive or a spreadsheet (unpack it or save it as CSV)"),
        (b"\x1f\x8b", "gzip-compressed data (unpack it first)"),
        (b"BZh", "bzip2-compressed data (unpack it first)"),
        (b"\xfd7zXZ\0", "xz-compressed data (unpack it first)"),
        (b"\x28\xb5\x2f\xfd", "zstd-compressed data (unpack it first)"),
        (b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive (unpack it first)"),
        (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
        (b"\xff\xd8\xff", "a JPEG picture"),
        (b"GIF8", "a GIF picture"),
        (b"%PDF-", "a PDF document"),
        (b"\x89HDF\r\n\x1a\n", "an HDF5 file (perhaps a MATLAB 7.3 file)"),
        (b"MATLAB 5.0 MAT-file", "a MATLAB file"),
        (b"PAR1", "a Parquet file"),
        (b"ARROW1", "an Arrow file"),
        (b"TDSm", "a TDMS file"),
        (b"\x7fELF", "a program"),
        (b"\xff\xfe", "UTF-16 text (save it as CSV in UTF-8)"),
        (b"\xfe\xff", "UTF-16 text (save it as CSV in UTF-8)"),
        (b"<?xml", "XML (perhaps GPX)"),
        (b"<!DOCTYPE", "an HTML page (perhaps a failed download)"),
        (b"<html", "an HTML page (perhaps a failed download)"),
        (b"{\"", "JSON"),
        (b"{\n", "JSON"),
        (b"[{", "JSON"),
        (b"$GP", "NMEA 0183 sentences"),
        (b"$GN", "NMEA 0183 sentences"),
        (b"[header]", "a VBOX file"),
    ];
    KNOWN.iter().find(|(magic, _)| head.starts_with(magic)).map(|(_, name)| *name)
}

/// The first byte that no text holds: `(offset, byte)`. Tab, line ends, form feed and DOS end of file are text.
pub(crate) fn binary_byte(head: &[u8]) -> Option<(usize, u8)> {
    let is_text = |b: u8| b >= 0x20 || matches!(b, b'\t' | b'\n' | b'\r' | 0x0b | 0x0c | 0x1a | 0x1b);
    head.iter().position(|&b| !is_text(b) || b == 0x7f).map(|i| (i, head[i]))
}
