//! Trains a network that reads hardness from touch, on a data set of `domecast dataset`.
//!
//! `DIR/model.onnx` is for `domecast track --hardness` and for ONNX Runtime, `DIR/metrics.json` says what the model is worth on
//! videos that it was not trained with, `DIR/index.html` shows it with the curves. While it runs, `DIR.checkpoint` keeps the last whole epoch.

mod calibrate;
mod data;
mod export;
mod judge;
mod net;
mod options;
mod page;
mod tar;
mod train;

use std::process::ExitCode;

use burn::module::Module;
use domecast_files::{OutputRules, StagedFolder};
use domecast_hardness::write_onnx;
use serde_json::json;
use sha2::{Digest, Sha256};

use data::{DataSet, Split};
use export::{Scales, graph};
use net::Net;
use options::{Options, USAGE};
use tar::Problem;
use train::Epoch;

fn setup(set: &DataSet, options: &Options, net: &Net) -> serde_json::Value {
    let inputs = [
        ("picture", options.picture),
        ("dots", options.dots),
        ("wrench", options.wrench),
        ("travel", options.travel),
        ("physics", options.physics),
    ];
    json!({
        "dataset": set.name,
        "net": if options.paper { "paper" } else { "small" },
        "inputs": inputs.iter().filter(|(_, used)| *used).map(|(name, _)| *name).collect::<Vec<_>>(),
        "picture": set.picture,
        "parameters": net.num_params(),
        "epochs": options.epochs,
        "batch": options.batch,
        "rate": options.rate,
        "optimizer": if options.sgd { "sgd" } else { "adamw" },
        "device": if options.gpu { "gpu" } else { "cpu" },
        "seed": options.seed,
        "leak": format!("{:?}", options.leak),
        "videos": { "train": set.part(Split::Train).len(), "val": set.part(Split::Val).len(), "test": set.part(Split::Test).len() },
        "left_out": set.left_out,
    })
}

/// Calibrates, judges and writes what came out.
fn finish(
    set: &DataSet,
    options: &Options,
    scales: &Scales,
    net: &Net,
    curve: &[Epoch],
) -> Result<(), Problem> {
    let [train, val, test] = [Split::Train, Split::Val, Split::Test].map(|split| set.part(split));
    let plain = graph(net, scales, &[]);
    let of_val = judge::outputs(&plain, set, &val)?;
    let scales = Scales { temperature: calibrate::temperature(&of_val, &val), ..scales.clone() };
    let states: Vec<Vec<f32>> =
        judge::outputs(&plain, set, &train)?.into_iter().map(|row| row.third).collect();
    let mut familiar = vec![calibrate::familiar(&states)];
    if set.seen > 0 {
        familiar.push(calibrate::familiar(&calibrate::last_readings(set, &train)));
    }
    let mut model = graph(net, &scales, &familiar);
    let of_val = judge::outputs(&model, set, &val)?;
    let setup = setup(set, options, net);
    let metadata = calibrate::metadata(set, &train, &val, &of_val, setup.clone());
    metadata.write_to(&mut model);
    let bytes = write_onnx(&model);
    let of_test = judge::outputs(&model, set, &test)?;
    let metrics = json!({
        "format": "domecast-learn",
        "version": 1,
        "setup": setup,
        "classes": set.classes,
        "temperature": scales.temperature,
        "curve": curve,
        "seconds": curve.iter().map(|epoch| epoch.seconds).sum::<f64>(),
        "test": judge::judgement(&of_test, &test, set, &metadata),
        "model_sha256": Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect::<String>(),
    });
    let rules = OutputRules { force: true, inputs: &[&options.dataset] };
    let folder = StagedFolder::new(&options.out, "learn", &rules).map_err(|e| e.to_string())?;
    let text = serde_json::to_string_pretty(&metrics).map_err(|e| e.to_string())? + "\n";
    folder.write("model.onnx", &bytes).map_err(|e| e.to_string())?;
    folder.write("metrics.json", text.as_bytes()).map_err(|e| e.to_string())?;
    folder.write("index.html", page::page(&metrics, curve).as_bytes()).map_err(|e| e.to_string())?;
    folder.commit().map_err(|e| e.to_string())?;
    println!(
        "{}",
        json!({ "out": options.out, "test": metrics["test"]["accuracy"], "modulus": metrics["test"]["modulus"],
                           "unsure": metrics["test"]["unsure"], "model_sha256": metrics["model_sha256"] })
    );
    Ok(())
}

fn run(arguments: &[String]) -> Result<(), Problem> {
    if arguments.iter().any(|argument| argument == "--help" || argument == "-h") {
        println!("{USAGE}");
        return Ok(());
    }
    let options = Options::parse(arguments)?;
    let set = data::load(&options.dataset, &options)?;
    let scales = train::scales_of(&set);
    match train::train(&set, &options, &scales)? {
        (Some(net), curve) => finish(&set, &options, &scales, &net, &curve),
        (None, curve) => {
            eprintln!("stopped after epoch {}; --resume goes on", curve.len());
            Ok(())
        }
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::FAILURE
        }
    }
}
