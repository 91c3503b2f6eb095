//! A textbook navigator in Rust for the protocol of sinssim: north-pointing, one sample a step, without a filter.
use std::io::{self, BufReader, BufWriter, Read, Write};

type V = [f64; 3];

fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
fn add(a: V, k: f64, b: V) -> V {
    [a[0] + k * b[0], a[1] + k * b[1], a[2] + k * b[2]]
}
fn resolve(q: [f64; 4], a: V) -> V {
    let v = [q[1], q[2], q[3]];
    add(a, 2.0, cross(v, add(cross(v, a), q[0], a)))
}
fn turned(q: [f64; 4], r: V) -> [f64; 4] {
    let angle = (r[0] * r[0] + r[1] * r[1] + r[2] * r[2]).sqrt();
    let s = if angle < 1e-8 { 0.5 } else { (0.5 * angle).sin() / angle };
    let (w, x, y, z) = ((0.5 * angle).cos(), s * r[0], s * r[1], s * r[2]);
    [q[0] * w - q[1] * x - q[2] * y - q[3] * z, q[0] * x + q[1] * w + q[2] * z - q[3] * y,
     q[0] * y - q[1] * z + q[2] * w + q[3] * x, q[0] * z + q[1] * y - q[2] * x + q[3] * w]
}
/// The state after one sample; `e` has a, f, GM, the rate of the Earth, gravity at the equator, Somigliana's constant.
fn step(x: &mut [f64], s: &[f64], e: &[f64]) {
    let (lat, h, v, q, dt) = (x[0], x[2], [x[3], x[4], x[5]], [x[6], x[7], x[8], x[9]], s[1]);
    let (a, f, sine) = (e[0], e[1], lat.sin());
    let (e2, m) = (f * (2.0 - f), e[3] * e[3] * a * a * a * (1.0 - f) / e[2]);
    let root = (1.0 - e2 * sine * sine).sqrt();
    let (rn, rm) = (a / root + h, a * (1.0 - e2) / root.powi(3) + h);
    let g = e[4] * (1.0 + e[5] * sine * sine) / root
        * (1.0 - 2.0 * h / a * (1.0 + f + m - 2.0 * f * sine * sine) + 3.0 * h * h / a / a);
    let earth = [e[3] * lat.cos(), 0.0, -e[3] * sine];
    let rate = add(earth, 1.0, [v[1] / rn, -v[0] / rm, -v[1] * lat.tan() / rn]);
    let (gyro, accel) = ([s[2], s[3], s[4]], [s[5], s[6], s[7]]);
    let force = resolve(q, add(accel, 0.5, cross(gyro, accel))); // the body turns within the sample, and so do the axes
    let force = add(force, -0.5 * dt, cross(rate, force));
    let now = add(add(add(v, 1.0, force), dt, [0.0, 0.0, g]), -dt, cross(add(rate, 1.0, earth), v));
    x[0] += 0.5 * (v[0] + now[0]) / rm * dt;
    x[1] += 0.5 * (v[1] + now[1]) / (rn * lat.cos()) * dt;
    x[2] -= 0.5 * (v[2] + now[2]) * dt;
    x[3..6].copy_from_slice(&now);
    let q = turned(q, gyro);
    let back = resolve([q[0], -q[1], -q[2], -q[3]], rate);
    x[6..10].copy_from_slice(&turned(q, add([0.0; 3], -dt, back)));
}
fn main() -> io::Result<()> {
    let (mut input, mut output) = (BufReader::new(io::stdin()), BufWriter::new(io::stdout()));
    let (mut header, mut head, mut state, mut earth) = ([0; 16], [0; 8], vec![], vec![]);
    input.read_exact(&mut header)?;
    assert_eq!(&header[..12], b"SINSSIM\0\x01\0\0\0", "another version of the protocol");
    output.write_all(&header)?;
    loop {
        input.read_exact(&mut head)?;
        let mut data = vec![0; u32::from_le_bytes(head[4..8].try_into().unwrap()) as usize];
        input.read_exact(&mut data)?;
        let numbers: Vec<f64> = data.chunks_exact(8).map(|c| f64::from_le_bytes(c.try_into().unwrap())).collect();
        match head[0] {
            1 => (state, earth) = (numbers[2..12].to_vec(), numbers[56..62].to_vec()),
            3 => {
                step(&mut state, &numbers, &earth);
                output.write_all(&[6, 0, 0, 0, 88, 0, 0, 0])?;
                for number in numbers[..1].iter().chain(&state) {
                    output.write_all(&number.to_le_bytes())?;
                }
                output.flush()?; // each answer at once, as step by step needs it
            }
            5 => return Ok(()),
            _ => {} // sensors and measurements, which a filter would use
        }
    }
}
