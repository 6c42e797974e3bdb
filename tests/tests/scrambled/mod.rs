//! Scrambled copies of simulated drives: how they are made.

pub mod verdict;

use std::collections::BTreeMap;

use drivescope_drive::channel::{Channel, Record};
use drivescope_drive::drive::Drive;
use drivescope_import::{RawColumn, Table, factor, signal};
use drivescope_simulation::{Simulation, named};

/// Numbers without a pattern, the same at each run (SplitMix64).
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }
    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
    fn within(&mut self, size: f64) -> f64 {
        size * ((self.next() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
    }
    fn shuffle<T>(&mut self, list: &mut [T]) {
        for i in (1..list.len()).rev() {
            list.swap(i, self.below(i + 1));
        }
    }
}

pub type Matrix = [[f64; 3]; 3];

pub fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transposed(a: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// Rotation from a housing with this roll, pitch and yaw to the car.
pub fn lean([roll, pitch, yaw]: [f64; 3]) -> Matrix {
    let m = drivescope_drive::frames::body_to_nav(roll, pitch, yaw);
    std::array::from_fn(|i| std::array::from_fn(|j| m[(i, j)]))
}

/// What was done to a drive.
pub struct Scramble {
    /// For each signal: its column and the factor from raw values to SI, sign included.
    pub scalars: BTreeMap<&'static str, (String, f64)>,
    /// For each triad: its columns, and raw values per SI value along the car's axes.
    pub triads: BTreeMap<&'static str, ([String; 3], Matrix)>,
    /// How late each channel is against the inertial sensor, s.
    pub late: BTreeMap<&'static str, f64>,
    pub shuffled: bool,
}

/// A drive as simulated, with what its truth excites.
pub struct Source {
    pub drive: Drive,
    /// Delays of the sensors as simulated: fixes, wheels and steering.
    pub own: [f64; 2],
    pub sharpest_turn: f64,
    pub climb: f64,
    pub heading: f64,
}

pub fn source(name: &'static str, seconds: f64) -> Source {
    let spec = named(name).unwrap();
    let own = match spec.sensors.as_str() {
        "phone" => [0.2, 0.0],
        "esc" => [0.0, 0.02],
        _ => [0.0, 0.0],
    };
    let mut simulation = Simulation::new(&spec, None).unwrap();
    simulation.advance(seconds);
    let drive = simulation.drive().clone();
    let spread = |values: &[f64]| {
        values.iter().copied().fold(f64::NEG_INFINITY, f64::max) - values.iter().copied().fold(f64::INFINITY, f64::min)
    };
    let mut heading = 0.0;
    let turned: Vec<f64> = drive
        .imu
        .column("gyro_z")
        .unwrap()
        .iter()
        .map(|w| {
            heading += 0.01 * w;
            heading
        })
        .collect();
    let turns = drive.imu.column("gyro_z").unwrap().iter().map(|w| w.abs()).fold(0.0, f64::max);
    let climb = spread(drive.truth.column("alt").unwrap_or(&[0.0]));
    Source { own, sharpest_turn: turns, climb, heading: spread(&turned), drive }
}

struct Builder<'a> {
    columns: Vec<RawColumn>,
    rows: usize,
    dice: &'a mut Dice,
    scramble: Scramble,
}

impl Builder<'_> {
    /// A column from samples `(row, SI value)`, `late` rows later, times `per_si`.
    fn push(&mut self, samples: impl Iterator<Item = (usize, f64)>, late: usize, per_si: f64) -> String {
        let mut values = vec![f64::NAN; self.rows];
        for (row, value) in samples {
            if let Some(cell) = values.get_mut(row + late) {
                *cell = value * per_si;
            }
        }
        // The sensor was already there before the first row.
        if let Some(first) = values
            .iter()
            .copied()
            .find(|v| v.is_finite())
            .filter(|_| late > 0 && values[late..].iter().take(2).all(|v| v.is_finite()))
        {
            values[..late].iter_mut().for_each(|v| *v = first);
        }
        let name = format!("k{}", self.columns.len());
        self.columns.push(RawColumn { name: name.clone(), values, ..RawColumn::default() });
        name
    }

    fn scalar<R: Record>(
        &mut self,
        channel: &Channel<R>,
        name: &'static str,
        late: usize,
        units: &[&str],
        signs: bool,
    ) {
        let Some(values) = channel.column(name).filter(|v| v.iter().any(|v| v.is_finite())) else { return };
        let unit = units[self.dice.below(units.len())];
        let sign = if signs && self.dice.below(2) == 0 { -1.0 } else { 1.0 };
        let to_si = factor(unit, signal(name).unwrap().unit).unwrap() * sign;
        let rows: Vec<usize> = channel.time().iter().map(|t| (t * 100.0).round() as usize).collect();
        let values = values.to_vec();
        let column = self.push(rows.into_iter().zip(values), late, 1.0 / to_si);
        self.scramble.scalars.insert(name, (column, to_si));
    }

    fn triad<R: Record>(
        &mut self,
        channel: &Channel<R>,
        names: [&'static str; 3],
        leaning: &Matrix,
        late: usize,
        units: &[&str],
    ) {
        let Some(values) = names.iter().map(|n| channel.column(n)).collect::<Option<Vec<_>>>() else { return };
        if !values.iter().all(|v| v.iter().all(|v| v.is_finite())) {
            return;
        }
        let unit = units[self.dice.below(units.len())];
        let one = 1.0 / factor(unit, signal(names[0]).unwrap().unit).unwrap();
        let mut order = [0, 1, 2];
        self.dice.shuffle(&mut order);
        let signs: [f64; 3] = std::array::from_fn(|_| if self.dice.below(2) == 0 { -1.0 } else { 1.0 });
        // What each column reads of the car's axes: the housing's axes, permuted and turned round.
        let housing = transposed(leaning);
        let matrix: Matrix = std::array::from_fn(|i| housing[order[i]].map(|v| v * signs[i] * one));
        let columns = std::array::from_fn(|i| {
            let read = |k: usize| (0..3).map(|j| matrix[i][j] * values[j][k]).sum::<f64>();
            let samples: Vec<(usize, f64)> =
                channel.time().iter().enumerate().map(|(k, t)| ((t * 100.0).round() as usize, read(k))).collect();
            self.push(samples.into_iter(), late, 1.0)
        });
        self.scramble.triads.insert(names[0], (columns, matrix));
    }
}

pub fn scrambled(source: &Source, seed: u64) -> (Table, Scramble) {
    let mut dice = Dice(seed);
    let drive = &source.drive;
    let late: [usize; 6] = std::array::from_fn(|_| dice.below(21));
    let [imu, mag, wheels, steering, gnss, baro] = late;
    let lag = |rows: usize| (rows as f64 - imu as f64) * 0.01;
    let (leaning, mag_leaning) = (
        lean(std::array::from_fn(|_| dice.within(15_f64.to_radians()))),
        lean(std::array::from_fn(|_| dice.within(15_f64.to_radians()))),
    );
    let mut b = Builder {
        columns: Vec::new(),
        rows: drive.imu.len(),
        scramble: Scramble {
            scalars: BTreeMap::new(),
            triads: BTreeMap::new(),
            late: BTreeMap::from([
                ("mag", lag(mag)),
                ("wheels", lag(wheels) + source.own[1]),
                ("steering", lag(steering) + source.own[1]),
                ("gnss", lag(gnss) + source.own[0]),
            ]),
            shuffled: dice.below(2) == 0,
        },
        dice: &mut dice,
    };
    let (unit, per_second) = [("s", 1.0), ("ms", 1e3), ("us", 1e6)][b.dice.below(3)];
    let start = b.dice.below(1000) as f64;
    let clock = b.push((0..drive.imu.len()).map(|k| (k, (start + 0.01 * k as f64) * per_second)), 0, 1.0);
    b.scramble.scalars.insert("t", (clock, factor(unit, "s").unwrap()));
    b.triad(&drive.imu, ["accel_x", "accel_y", "accel_z"], &leaning, imu, &["m/s^2", "g", "mg"]);
    b.triad(&drive.imu, ["gyro_x", "gyro_y", "gyro_z"], &leaning, imu, &["rad/s", "deg/s"]);
    b.triad(&drive.mag, ["mag_x", "mag_y", "mag_z"], &mag_leaning, mag, &["uT", "G", "mG", "nT", "T"]);
    let speeds = ["m/s", "km/h", "mph", "knots"];
    let same = [speeds[b.dice.below(4)]];
    for name in ["wheel_speed_fl", "wheel_speed_fr", "wheel_speed_rl", "wheel_speed_rr"] {
        b.scalar(&drive.wheels, name, wheels, &same, false);
    }
    b.scalar(&drive.wheels, "speed", wheels, &speeds, false);
    b.scalar(&drive.steering, "steering_wheel", steering, &["rad", "deg"], true);
    b.scalar(&drive.steering, "steer", steering, &["rad", "deg"], true);
    let angle = [["deg"], ["rad"], ["1e-7 deg"]][b.dice.below(3)];
    b.scalar(&drive.gnss, "gnss_lat", gnss, &angle, false);
    b.scalar(&drive.gnss, "gnss_lon", gnss, &angle, false);
    let velocity = [speeds[b.dice.below(4)]];
    b.scalar(&drive.gnss, "gnss_vn", gnss, &velocity, false);
    b.scalar(&drive.gnss, "gnss_ve", gnss, &velocity, false);
    b.scalar(&drive.gnss, "gnss_vd", gnss, &velocity, true);
    b.scalar(&drive.gnss, "gnss_speed", gnss, &speeds, false);
    b.scalar(&drive.gnss, "course", gnss, &["deg", "rad"], false);
    b.scalar(&drive.gnss, "gnss_alt", gnss, &["m", "ft"], false);
    b.scalar(&drive.baro, "baro_alt", baro, &["m", "ft"], false);
    for name in ["gnss_std_n", "gnss_std_e", "gnss_std_d", "gnss_nsat", "gnss_pdop", "gnss_valid"] {
        let unit = if name.contains("std") { "m" } else { "1" };
        b.scalar(&drive.gnss, name, gnss, &[unit], false);
    }
    finish(b)
}

/// Put the columns into random order and take their names away or shuffle them.
fn finish(b: Builder) -> (Table, Scramble) {
    let Builder { mut columns, rows, dice, mut scramble } = b;
    // The names that the columns deserve.
    let mut names: Vec<String> = columns
        .iter()
        .map(|c| {
            let scalar =
                scramble.scalars.iter().find(|(_, (column, _))| *column == c.name).map(|(n, _)| (*n).to_owned());
            scalar.unwrap_or_else(|| {
                let (first, (list, _)) = scramble.triads.iter().find(|(_, (list, _))| list.contains(&c.name)).unwrap();
                let axis = list.iter().position(|n| *n == c.name).unwrap();
                format!("{}{}", &first[..first.len() - 1], ["x", "y", "z"][axis])
            })
        })
        .collect();
    dice.shuffle(&mut columns);
    if scramble.shuffled {
        dice.shuffle(&mut names);
    }
    let mut renamed = BTreeMap::new();
    for (i, column) in columns.iter_mut().enumerate() {
        let name = if scramble.shuffled { names[i].clone() } else { format!("c{}", i + 1) };
        renamed.insert(std::mem::replace(&mut column.name, name.clone()), name);
    }
    scramble.scalars.values_mut().for_each(|(c, _)| *c = renamed[c].clone());
    scramble.triads.values_mut().for_each(|(list, _)| list.iter_mut().for_each(|c| *c = renamed[c].clone()));
    let mut table = Table::default();
    (table.name, table.columns, table.rows) = ("scrambled.csv".into(), columns, rows);
    (table, scramble)
}
