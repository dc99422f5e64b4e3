//! Runs a network of hardness on numbers from a file, as its judge in Python does, or takes its time.
//!
//!     hardness run MODEL NUMBERS       little-endian floats: of each frame the picture [row][column][channel], then readings;
//!                                      prints the outputs of each full window, a JSON object a line
//!     hardness time MODEL ROUNDS       microseconds of one frame's part, of the window's, and of ten whole frames
//!     hardness rewrite MODEL OUT       reads the graph and writes it again
//!     hardness check MODEL             reads the model with its metadata

use std::path::Path;
use std::time::Instant;

use domecast_hardness::{HardnessReader, Network, read_onnx, write_onnx};

type Problem = Box<dyn std::error::Error>;

fn run(network: &mut Network, numbers: &[f32]) -> Result<(), Problem> {
    let picture = network.picture_dims().map_or(0, |dims| dims.iter().product());
    for frame in numbers.chunks_exact(picture + network.readings_count()) {
        network.push(&frame[..picture], &frame[picture..]);
        if network.run() {
            let outputs = ["probability", "log10_e", "novelty"].map(|name| (name, network.output(name)));
            let line: serde_json::Map<_, _> =
                outputs.into_iter().map(|(name, values)| (name.to_string(), values.into())).collect();
            println!("{}", serde_json::Value::Object(line));
        }
    }
    Ok(())
}

fn median_us(rounds: usize, mut work: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..rounds.max(1))
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64() * 1e6
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn time(network: &mut Network, rounds: usize) {
    let picture = vec![0.1; network.picture_dims().map_or(0, |dims| dims.iter().product())];
    let readings = vec![0.1; network.readings_count()];
    let window = network.window();
    let frame_us = median_us(rounds * window, || network.push(&picture, &readings));
    let window_us = median_us(rounds, || _ = network.run());
    let whole_us = median_us(rounds, || {
        (0..window).for_each(|_| network.push(&picture, &readings));
        network.run();
    });
    println!("{{\"frame_us\":{frame_us:.1},\"window_us\":{window_us:.1},\"all_frames_us\":{whole_us:.1}}}");
}

fn main() -> Result<(), Problem> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let graph = |path: &str| -> Result<_, Problem> { Ok(read_onnx(&std::fs::read(path)?)?) };
    match arguments.as_slice() {
        ["run", model, numbers] => {
            let bytes = std::fs::read(numbers)?;
            let numbers: Vec<f32> =
                bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
            run(&mut Network::new(&graph(model)?)?, &numbers)
        }
        ["time", model, rounds] => {
            time(&mut Network::new(&graph(model)?)?, rounds.parse()?);
            Ok(())
        }
        ["rewrite", model, out] => Ok(std::fs::write(out, write_onnx(&graph(model)?))?),
        ["check", model] => {
            let reader = HardnessReader::load(Path::new(model))?;
            println!("{}", serde_json::json!(reader.metadata()));
            Ok(())
        }
        _ => Err("usage: hardness run|time|rewrite|check MODEL [NUMBERS|ROUNDS|OUT]".into()),
    }
}
