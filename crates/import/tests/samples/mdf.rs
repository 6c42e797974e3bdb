//! MDF4 files, written block by block.

use super::{ROWS, frames, rate, time, zlib};

/// How the records lie in the file.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Form {
    Sorted,
    Unsorted,
    Deflated,
    Transposed,
    Unfinished,
}

/// A file that grows block by block; links are filled in afterwards.
struct File {
    bytes: Vec<u8>,
}

impl File {
    fn new(unfinished: bool) -> Self {
        let mut bytes =
            if unfinished { b"UnFinMF 4.10    test    ".to_vec() } else { b"MDF     4.10    test    ".to_vec() };
        bytes.extend([0; 4]);
        bytes.extend(410u16.to_le_bytes());
        bytes.resize(64, 0);
        Self { bytes }
    }

    fn block(&mut self, id: &[u8; 4], links: &[u64], data: &[u8]) -> u64 {
        while !self.bytes.len().is_multiple_of(8) {
            self.bytes.push(0);
        }
        let at = self.bytes.len() as u64;
        self.bytes.extend(id);
        self.bytes.extend([0; 4]);
        self.bytes.extend((24 + 8 * links.len() as u64 + data.len() as u64).to_le_bytes());
        self.bytes.extend((links.len() as u64).to_le_bytes());
        links.iter().for_each(|l| self.bytes.extend(l.to_le_bytes()));
        self.bytes.extend(data);
        at
    }

    fn link(&mut self, block: u64, index: usize, to: u64) {
        let at = block as usize + 24 + 8 * index;
        self.bytes[at..at + 8].copy_from_slice(&to.to_le_bytes());
    }

    fn text(&mut self, text: &str) -> u64 {
        self.block(b"##TX", &[], format!("{text}\0").as_bytes())
    }

    fn header(&mut self) -> u64 {
        let mut data = 1_717_156_800_000_000_000u64.to_le_bytes().to_vec();
        data.resize(32, 0);
        self.block(b"##HD", &[0; 6], &data)
    }

    #[allow(clippy::too_many_arguments, reason = "the fields of the block")]
    fn channel(
        &mut self,
        next: u64,
        name: &str,
        unit: &str,
        kind: u8,
        data_type: u8,
        place: [u32; 3],
        linear: Option<[f64; 2]>,
    ) -> u64 {
        let (name, unit) = (self.text(name), self.text(unit));
        let conversion = linear.map_or(0, |values| {
            let mut data = vec![1, 0, 0, 0, 0, 0, 2, 0];
            data.extend([0; 16]);
            values.iter().for_each(|v| data.extend(v.to_le_bytes()));
            self.block(b"##CC", &[0; 4], &data)
        });
        let [byte, bit, bits] = place;
        let mut data = vec![kind, u8::from(kind == 2), data_type, bit as u8];
        data.extend(byte.to_le_bytes());
        data.extend(bits.to_le_bytes());
        data.resize(72, 0);
        self.block(b"##CN", &[next, 0, name, 0, conversion, 0, unit, 0], &data)
    }

    fn group(&mut self, next: u64, channels: u64, number: u64, flags: u16, data_bytes: u32) -> u64 {
        let mut data = number.to_le_bytes().to_vec();
        data.extend((ROWS as u64).to_le_bytes());
        data.extend(flags.to_le_bytes());
        data.resize(24, 0);
        data.extend(data_bytes.to_le_bytes());
        data.extend([0; 4]);
        self.block(b"##CG", &[next, channels, 0, 0, 0, 0], &data)
    }
}

fn record(i: usize) -> Vec<u8> {
    let mut out = time(i).to_le_bytes().to_vec();
    out.extend((i as i16).to_be_bytes());
    out.extend((rate(i) as f32).to_le_bytes());
    out
}

/// Time, forward acceleration (big-endian, converted) and yaw rate.
pub fn measured(form: Form) -> Vec<u8> {
    let mut file = File::new(form == Form::Unfinished);
    let header = file.header();
    let yaw = file.channel(0, "gyro_z", "rad/s", 0, 4, [10, 0, 32], None);
    let forward = file.channel(yaw, "accel_x", "m/s^2", 0, 3, [8, 0, 16], Some([0.0, 0.01]));
    let clock = file.channel(forward, "time", "s", 2, 4, [0, 0, 64], None);
    let unsorted = form == Form::Unsorted;
    let other = if unsorted { file.group(0, 0, 2, 0, 3) } else { 0 };
    let group = file.group(other, clock, 1, 0, 14);
    let mut records = Vec::new();
    for i in 0..ROWS {
        if unsorted {
            records.extend([2, 9, 9, 9, 1]);
        }
        records.extend(record(i));
    }
    let data = match form {
        Form::Sorted => {
            // Two blocks below a list, cut inside a record.
            let (a, b) = records.split_at(100);
            let (a, b) = (file.block(b"##DT", &[], a), file.block(b"##DT", &[], b));
            file.block(b"##DL", &[0, a, b], &[0; 24])
        }
        Form::Deflated | Form::Transposed => {
            let transposed = form == Form::Transposed;
            let plain = if transposed { columns(&records, 14) } else { records.clone() };
            let packed = zlib(&plain);
            let mut data = b"DT".to_vec();
            data.extend([u8::from(transposed), 0]);
            data.extend(14u32.to_le_bytes());
            data.extend((records.len() as u64).to_le_bytes());
            data.extend((packed.len() as u64).to_le_bytes());
            data.extend(packed);
            let block = file.block(b"##DZ", &[], &data);
            let list = file.block(b"##DL", &[0, block], &[0; 16]);
            file.block(b"##HL", &[list], &[0; 8])
        }
        Form::Unsorted | Form::Unfinished => 0,
    };
    let groups = file.block(b"##DG", &[0, group, data, 0], &[u8::from(unsorted), 0, 0, 0, 0, 0, 0, 0]);
    file.link(header, 0, groups);
    if data == 0 {
        let data = file.block(b"##DT", &[], &records);
        file.link(groups, 2, data);
        if form == Form::Unfinished {
            let at = data as usize + 8;
            file.bytes[at..at + 8].copy_from_slice(&24u64.to_le_bytes());
        }
    }
    file.bytes
}

fn columns(records: &[u8], width: usize) -> Vec<u8> {
    let rows = records.len() / width;
    (0..width).flat_map(|c| (0..rows).map(move |r| records[r * width + c])).collect()
}

/// Frames whose bytes come as records of variable length, unsorted and unfinished.
pub fn bus() -> Vec<u8> {
    let mut file = File::new(true);
    let header = file.header();
    let bytes = file.channel(0, "CAN_DataFrame.DataBytes", "", 1, 10, [14, 0, 64], None);
    let length = file.channel(bytes, "CAN_DataFrame.DataLength", "", 0, 0, [13, 0, 8], None);
    let extended = file.channel(length, "CAN_DataFrame.IDE", "", 0, 0, [12, 0, 1], None);
    let id = file.channel(extended, "CAN_DataFrame.ID", "", 0, 0, [8, 0, 29], None);
    let clock = file.channel(id, "Timestamp", "", 2, 4, [0, 0, 64], Some([0.0, 1e-6]));
    let variable = file.group(0, 0, 2, 1, 0);
    let group = file.group(variable, clock, 1, 6, 22);
    file.link(bytes, 5, variable);
    let groups = file.block(b"##DG", &[0, group, 0, 0], &[1, 0, 0, 0, 0, 0, 0, 0]);
    file.link(header, 0, groups);
    let mut records = Vec::new();
    let mut offset = 0u64;
    for (us, id, extended, data) in frames() {
        records.push(1);
        records.extend((us as f64).to_le_bytes());
        records.extend(id.to_le_bytes());
        records.extend([u8::from(extended), 8]);
        records.extend(offset.to_le_bytes());
        records.push(2);
        records.extend(8u32.to_le_bytes());
        records.extend(data);
        offset += 12;
    }
    let data = file.block(b"##DT", &[], &records);
    file.link(groups, 2, data);
    let at = data as usize + 8;
    file.bytes[at..at + 8].copy_from_slice(&24u64.to_le_bytes());
    file.bytes
}
