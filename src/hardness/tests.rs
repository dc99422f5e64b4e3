//! A small model of every kind of node: what it refuses, when it is unsure, that it allocates nothing.

use crate::physics::{Hardness, HardnessStatus};
use crate::{
    Attribute, Class, FrameView, Graph, HardnessEstimate, HardnessReader, Metadata, ModelReading, Network,
    Port, REST_NUMBERS, Unsure, read_onnx, rest_profile, write_onnx,
};

const WINDOW: usize = 4;
const SIDE: usize = 8;
const HIDDEN: usize = 3;

/// Numbers from -1 to 1 that look drawn, of a count.
fn numbers(count: usize, seed: usize) -> Vec<f32> {
    (0..count).map(|at| (((at * 7919 + seed * 104_729) % 1009) as f32 / 504.5) - 1.0).collect()
}

fn ints(values: &[i64]) -> Attribute {
    Attribute::Ints(values.to_vec())
}

/// What sees the picture: 4 numbers.
fn eye(graph: &mut Graph) {
    graph.floats("w", &[4, 3, 3, 3], numbers(108, 1));
    graph.floats("b", &[4], numbers(4, 2));
    let settings = [("kernel_shape", ints(&[3, 3])), ("strides", ints(&[2, 2])), ("pads", ints(&[1; 4]))];
    graph.node("Conv", &["picture", "w", "b"], "c", &settings);
    graph.node("Relu", &["c"], "r", &[]);
    graph.node("MaxPool", &["r"], "m", &[("kernel_shape", ints(&[2, 2])), ("strides", ints(&[1, 1]))]);
    graph.node("Add", &["m", "m"], "a", &[]);
    graph.node("GlobalAveragePool", &["a"], "g", &[]);
    graph.node("Flatten", &["g"], "f", &[]);
}

fn graph() -> Graph {
    let mut graph = Graph::default();
    let port = |name: &str, dims: &[usize]| Port { name: name.into(), dims: dims.to_vec() };
    graph.inputs = vec![port("picture", &[WINDOW, 3, SIDE, SIDE]), port("readings", &[WINDOW, 2])];
    eye(&mut graph);
    graph.node("Concat", &["f", "readings"], "j", &[("axis", Attribute::Int(1))]);
    graph.ints("one", vec![1]);
    graph.node("Unsqueeze", &["j", "one"], "u", &[]);
    graph.floats("gw", &[2, 3 * HIDDEN, 6], numbers(2 * 3 * HIDDEN * 6, 3));
    graph.floats("gr", &[2, 3 * HIDDEN, HIDDEN], numbers(2 * 3 * HIDDEN * HIDDEN, 4));
    graph.floats("gb", &[2, 6 * HIDDEN], numbers(12 * HIDDEN, 5));
    let settings = [
        ("hidden_size", Attribute::Int(HIDDEN as i64)),
        ("direction", Attribute::Text("bidirectional".into())),
        ("linear_before_reset", Attribute::Int(1)),
    ];
    graph.node("GRU", &["u", "gw", "gr", "gb"], "s", &settings);
    let cut = [("from", vec![2]), ("to", vec![WINDOW as i64]), ("axis", vec![0]), ("sides", vec![1, 6])];
    cut.into_iter().for_each(|(name, values)| _ = graph.ints(name, values));
    graph.node("Slice", &["s", "from", "to", "axis"], "l", &[]);
    graph.node("ReduceMean", &["l"], "n", &[("axes", ints(&[0])), ("keepdims", Attribute::Int(0))]);
    graph.node("Reshape", &["n", "sides"], "state", &[]);
    graph.floats("cw", &[6, 2], numbers(12, 6));
    graph.floats("cb", &[2], numbers(2, 7));
    graph.node("Gemm", &["state", "cw", "cb"], "k", &[]);
    graph.node("Softmax", &["k"], "probability", &[("axis", Attribute::Int(1))]);
    graph.node("Gemm", &["state", "cw", "cb"], "log10_e", &[]);
    graph.node("ReduceSumSquare", &["state"], "novelty", &[("axes", ints(&[1]))]);
    graph.outputs = vec![port("probability", &[1, 2]), port("log10_e", &[1, 2]), port("novelty", &[1, 1])];
    graph
}

/// A frame of a level that rises from row to row.
fn frame(level: u8) -> Vec<u8> {
    (0..SIDE * SIDE * 3).map(|at| level + (at / 3 / SIDE) as u8).collect()
}

fn view(bytes: &[u8]) -> FrameView<'_> {
    FrameView { width: SIDE, height: SIDE, channels: 3, bytes }
}

fn model() -> Vec<u8> {
    model_of(1.6)
}

fn model_of(interval_quantile: f64) -> Vec<u8> {
    let reading = |name: &str, range| ModelReading { name: name.into(), range };
    let levels: Vec<f32> = frame(100).iter().map(|level| f32::from(*level)).collect();
    let profile = rest_profile(&levels, [SIDE, SIDE]);
    let metadata = Metadata {
        version: 1,
        classes: [("soft", 0.1), ("hard", 1.0)]
            .map(|(name, mpa)| Class { name: name.into(), youngs_modulus_mpa: Some(mpa) })
            .to_vec(),
        readings: vec![
            reading("fx_n", [-0.2, 0.2]),
            reading("fz_n", [-1.5, -0.4]),
            // the network does not see it
            reading("dots_mean_px", [1.0, 5.0]),
        ],
        rest_ranges: profile.map(|value| [0.9 * value, 1.1 * value]).to_vec(),
        log10_e_range: [-3.0, 3.0],
        interval_quantile,
        novelty_limits: vec![1e3],
        novelty_names: vec!["features".into()],
        training: serde_json::Value::Null,
    };
    let mut graph = graph();
    metadata.write_to(&mut graph);
    write_onnx(&graph)
}

const TOUCH: [f64; 3] = [0.1, -1.0, 3.0];

/// What is stated after a whole window of one frame and one row of readings.
fn stated(reader: &mut HardnessReader, level: u8, readings: &[f64]) -> Option<Result<usize, Unsure>> {
    let bytes = frame(level);
    let found = (0..WINDOW).map(|_| reader.push(Some(&view(&bytes)), readings)).last().flatten();
    found.map(|found| found.map(|found| found.class))
}

fn reader() -> HardnessReader {
    let mut reader = HardnessReader::new(&model()).expect("a model");
    assert!(reader.set_rest(&view(&frame(100))));
    reader
}

#[test]
fn a_touch_like_those_of_the_training_is_stated_once_the_window_is_full() {
    let mut reader = reader();
    let bytes = frame(110);
    for at in 1..3 * WINDOW {
        let found = reader.push(Some(&view(&bytes)), &TOUCH);
        assert_eq!(found.is_some(), at >= WINDOW, "frame {at}");
        if let Some(found) = found {
            let found = found.expect("it is like the training");
            assert!((0.5..=1.0).contains(&found.probability), "{found:?}");
            assert!(found.interval[0] < found.log10_e_mpa && found.log10_e_mpa < found.interval[1]);
        }
    }
    // a frame that is missing, or a number of it: the window begins again
    assert!(reader.push(None, &TOUCH).is_none() && reader.push(Some(&view(&bytes)), &TOUCH).is_none());
    assert!(matches!(stated(&mut reader, 110, &TOUCH), Some(Ok(_))));
    assert!(reader.push(Some(&view(&bytes)), &[0.1, f64::NAN, 3.0]).is_none());
    assert!(reader.push(Some(&view(&bytes)), &TOUCH).is_none());
}

#[test]
fn what_is_unlike_the_training_is_unsure() {
    let mut reader = reader();
    assert!(matches!(stated(&mut reader, 110, &TOUCH), Some(Ok(_))));
    let unsure = |reader: &mut HardnessReader, readings: &[f64]| match stated(reader, 110, readings) {
        Some(Err(unsure)) => reader.reason(unsure),
        other => panic!("{other:?}"),
    };
    // no contact, a shear and dots that the training never had
    assert_eq!(unsure(&mut reader, &[0.0, 0.0, 3.0]), "out_of_range_fz_n");
    assert_eq!(unsure(&mut reader, &[0.0, -0.1, 3.0]), "out_of_range_fz_n");
    assert_eq!(unsure(&mut reader, &[1.0, -1.0, 3.0]), "out_of_range_fx_n");
    assert_eq!(unsure(&mut reader, &[0.1, -1.0, 30.0]), "out_of_range_dots_mean_px");
    // less light
    assert!(reader.set_rest(&view(&frame(60))));
    assert_eq!(unsure(&mut reader, &TOUCH), "out_of_range_light");
    // a lens that sees another part of the dome: as bright on the whole, not in each place
    let mut turned = frame(100);
    turned[..SIDE * SIDE * 3 / 2].iter_mut().for_each(|level| *level -= 40);
    turned[SIDE * SIDE * 3 / 2..].iter_mut().for_each(|level| *level += 40);
    assert!(reader.set_rest(&view(&turned)));
    assert_eq!(unsure(&mut reader, &TOUCH), "unlike_training_rest");
}

#[test]
fn a_class_that_is_no_more_than_a_guess_is_not_stated_alone() {
    let mut reader = reader();
    let bytes = frame(110);
    let found = (0..WINDOW).map(|_| reader.push(Some(&view(&bytes)), &TOUCH)).last().flatten();
    let probability = found.and_then(Result::ok).expect("it states the modulus").probability;
    assert!(probability < 0.9, "{probability}");
    let mut reader = HardnessReader::new(&model_of(0.0)).expect("a model of classes");
    assert!(reader.set_rest(&view(&frame(100))) && !reader.states_modulus());
    assert_eq!(stated(&mut reader, 110, &TOUCH), Some(Err(Unsure::Undecided)));
    assert_eq!(reader.reason(Unsure::Undecided), "undecided");
}

#[test]
fn contact_mechanics_has_a_say_where_it_says_something_else() {
    let of = |log10_young: f64| Hardness {
        log10_young,
        interval: [log10_young - 0.1, log10_young + 0.1],
        status: HardnessStatus::Ok,
    };
    let found = |class, interval: [f64; 2]| HardnessEstimate {
        class,
        probability: 0.95,
        log10_e_mpa: 0.5 * (interval[0] + interval[1]),
        interval,
    };
    // a modulus: where the intervals have nothing in common
    let moduli = HardnessReader::new(&model()).expect("a model");
    for (interval, contradicts) in
        [([-0.6, -0.3], false), ([-0.35, 0.0], false), ([-0.2, 0.0], true), ([-0.9, -0.7], true)]
    {
        assert_eq!(moduli.contradicts(&found(0, interval), &of(-0.4)), contradicts, "{interval:?}");
    }
    // classes alone: the nearest one
    let classes = HardnessReader::new(&model_of(0.0)).expect("a model");
    for (class, log10_young, contradicts) in [
        (0, -1.5, false),
        (0, -0.51, false),
        (0, -0.49, true),
        (1, -0.49, false),
        (1, 0.9, false),
        (1, -0.9, true),
    ] {
        assert_eq!(classes.contradicts(&found(class, [0.0; 2]), &of(log10_young)), contradicts, "{class}");
    }
}

#[test]
fn numbers_that_end_nowhere_are_never_stated() {
    let mut reader = reader();
    for value in [f64::MAX, f64::MIN, f64::INFINITY, 1e30, -0.0] {
        for at in 0..TOUCH.len() {
            let mut readings = TOUCH;
            readings[at] = value;
            if let Some(Ok(_)) = stated(&mut reader, 255 - SIDE as u8, &readings) {
                assert_eq!(value, 0.0, "reading {at} of {value}");
            }
        }
    }
    for readings in [&[][..], &[0.1], &[0.1; 9]] {
        assert_eq!(stated(&mut reader, 110, readings), None);
    }
    for (width, bytes) in [(SIDE, &[1_u8; 5][..]), (usize::MAX, &[]), (0, &[])] {
        assert!(!reader.set_rest(&FrameView { width, height: SIDE, channels: 3, bytes }));
        assert_eq!(stated(&mut reader, 110, &TOUCH), None, "there is no rest");
    }
}

#[test]
fn nothing_is_allocated_after_the_first_frame() {
    let mut reader = reader();
    let bytes = frame(110);
    let count = allocation_counter::measure(|| {
        for _ in 0..3 * WINDOW {
            _ = std::hint::black_box(reader.push(Some(&view(&bytes)), &TOUCH));
        }
    });
    assert_eq!(count.count_total, 0);
}

/// Reads a file and, where it is taken, runs it.
fn survive(bytes: &[u8]) -> bool {
    let Ok(mut reader) = HardnessReader::new(bytes) else { return false };
    let level = frame(100);
    let readings = vec![0.1; reader.metadata().readings.len()];
    reader.set_rest(&view(&level));
    for _ in 0..WINDOW {
        if let Some(Ok(found)) = reader.push(Some(&view(&level)), &readings) {
            let numbers = [found.probability, found.log10_e_mpa, found.interval[0], found.interval[1]];
            assert!(numbers.iter().all(|value| value.is_finite()));
        }
    }
    true
}

#[test]
fn no_file_that_is_cut_or_changed_makes_a_panic() {
    let good = model();
    assert!(survive(&good));
    for length in 0..good.len() {
        assert!(!survive(&good[..length]), "cut to {length} of {} bytes", good.len());
    }
    let mut taken = 0;
    for at in 0..good.len() {
        let mut bytes = good.clone();
        for bit in 0..8 {
            bytes[at] = good[at] ^ 1 << bit;
            taken += usize::from(survive(&bytes));
        }
    }
    // a bit of a weight or of a name makes another model, one of the structure none
    assert!(taken > 100 && taken < 8 * good.len(), "{taken} of {}", 8 * good.len());
}

#[test]
fn a_graph_is_read_as_it_was_written() {
    let graph = graph();
    assert_eq!(read_onnx(&write_onnx(&graph)), Ok(graph.clone()));
    let network = Network::new(&graph).expect("a network");
    assert_eq!((network.window(), network.picture_dims()), (WINDOW, Some([3, SIDE, SIDE])));
    // metadata that do not fit the network
    let change = |from: &str, to: &str| {
        let mut graph = read_onnx(&model()).expect("a graph");
        graph.metadata.iter_mut().for_each(|(_, text)| *text = text.replacen(from, to, 1));
        HardnessReader::new(&write_onnx(&graph)).map(|_| ()).expect_err(to)
    };
    for (from, to) in [
        ("\"version\":1", "\"version\":2"),
        ("\"novelty_limits\":[1000.0]", "\"novelty_limits\":[]"),
        ("\"novelty_limits\":[1000.0]", "\"novelty_limits\":[-1.0]"),
        ("\"range\":[-1.5,-0.4]", "\"range\":[-0.4,-1.5]"),
        ("\"rest_ranges\":[", "\"rest_ranges\":[[0,1],"),
        ("\"name\":\"hard\"", "\"name\":\"hard\",\"more\":1"),
    ] {
        assert!(change(from, to).at.contains("domecast_hardness"), "{from}");
    }
    assert_eq!(rest_profile(&[], [0, 0]).len(), REST_NUMBERS);
}
