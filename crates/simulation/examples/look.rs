//! Simulate a named drive and print what is in it.
use std::time::Instant;
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "city_hills".into());
    let spec = drivescope_simulation::named(&name).ok_or("no such drive")?;
    let start = Instant::now();
    let drive = drivescope_simulation::simulate(&spec, None)?;
    let took = start.elapsed().as_secs_f64();
    let span = drive.span().ok_or("empty")?;
    println!("{} samples, {:.1} s simulated in {took:.3} s", drive.imu.len(), span.1);
    let t = &drive.truth;
    for (i, column) in t.schema().iter().enumerate() {
        let c = t.column_at(i);
        let (lo, hi) = c.iter().filter(|v| v.is_finite()).fold((f64::MAX, f64::MIN), |a, &v| (a.0.min(v), a.1.max(v)));
        println!("{:18} {lo:14.6} {hi:14.6} {}", column.name, column.unit);
    }
    if let Some(path) = std::env::args().nth(2) {
        let mut text = String::from("t");
        t.schema().iter().for_each(|c| text += &format!(",{}", c.name));
        text += ",ax,ay,az,gx,gy,gz,speed,steer\n";
        for k in 0..t.len() {
            text += &t.time()[k].to_string();
            (0..t.schema().len()).for_each(|i| text += &format!(",{}", t.column_at(i)[k]));
            let (_, m) = drive.imu.at(k);
            text += &format!(
                ",{},{},{},{},{},{},{},{}\n",
                m.accel_x,
                m.accel_y,
                m.accel_z,
                m.gyro_x,
                m.gyro_y,
                m.gyro_z,
                drive.wheels.at(k).1.speed,
                drive.steering.at(k).1.steer
            );
        }
        std::fs::write(path, text)?;
    }
    Ok(())
}
