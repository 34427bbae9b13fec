//! One suite for every backend: the forward pass, the gradients of all losses, and five training steps, on
//! clouds of built-in shapes, against flex with its custom operations in `f32`.
//!
//! Held against it are flex in `f64`, which takes Burn's own operations throughout, and each backend
//! that this program was built with. A backend that this machine cannot run is skipped with a word, unless
//! `$SRRF_REQUIRE_DEVICE` names it.
//!
//! Tolerances, in shares of the largest number compared. Sums in another order differ by some 1e-6 in `f32`;
//! ten layers, a softmax and the 3 x 3 SVD make up to 1e-5 of it in the output, and the way
//! back doubles the depth ([`F32`]). Adam divides by the gradient's own size, so that parameters whose
//! gradient is rounding alone move by whole steps in a direction of their own: five steps are compared
//! by their losses and by the norm of what all parameters moved together.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "a test says what it skips")]

use std::collections::BTreeMap;
use std::path::Path;

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::optim::GradientsParams;
use burn::tensor::{DType, Device, Tensor};
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_model::weights::parameters;
use srrf_model::{
    MatchingConfig, Srrf, TrainingBatch, correspondence_loss, init, registration_loss, skeleton_loss,
};
use srrf_train::data::TrainingPairs;
use srrf_train::nets::srrf::{Layout, SemTraining, SrrfParts};
use srrf_train::optimizer::optimizer;
use srrf_train::rows::Updater;
use srrf_train::step::{PreparedBatch, StepContext, gradient, prepare, to_batch};
use srrf_train::workers::Workers;
use srrf_train::{TrainConfig, Trained};

/// How far apart two devices may be.
struct Tolerances {
    forward: f64,
    gradient: f64,
    losses: f64,
    moved: f64,
}

const F32: Tolerances = Tolerances { forward: 1e-4, gradient: 1e-3, losses: 1e-3, moved: 1e-2 };

/// Those on `cuda`: CubeCL's kernels for tensor cores round `f32` factors to TF32, whose unit roundoff is `2^-11`, or 4.9e-4,
/// where that of `f32` is 6.0e-8, and Burn has no switch for it. In `f32` the output is 100 roundoffs from `f64` and the gradient
/// 1,500, so that TF32 could leave them 0.05 and 0.7 apart. On an H100 they came out 5.5e-3 and 6.7e-2 apart, the losses
/// 4.1e-2 and the parameters 5.1e-2; each may be two to four times that. A wrong gradient is apart by 1.
const TF32: Tolerances = Tolerances { forward: 2e-2, gradient: 0.2, losses: 0.1, moved: 0.2 };

impl Tolerances {
    /// Those of a device, or of a few by turns, the first of which is named first.
    fn of(name: &str) -> &'static Self {
        if name.starts_with("cuda") { &TF32 } else { &F32 }
    }
}

const PAIRS: usize = 3;
const STEPS: usize = 5;
const PHASE: f32 = 0.5;

/// What one pass gave: named numbers.
type Numbers = BTreeMap<String, Vec<f64>>;

/// The smoke configuration with whole clouds, so that every shard has the same shapes, and small batches.
fn config() -> TrainConfig {
    let path = Path::new(&std::env::var("CARGO_MANIFEST_DIR").unwrap()).join("../../configs/smoke.toml");
    let mut config = <TrainConfig>::read(&path).unwrap();
    config.draw.independent = 0.0;
    (config.optimizer.batch, config.optimizer.shard) = (4, 2);
    // One branch as the paper has it, the other with all that the matching can do.
    config.network.dense.matching = MatchingConfig { normalise: true, sinkhorn: 3 };
    config.losses.matching = 0.5;
    config
}

fn pairs(config: &TrainConfig) -> TrainingPairs {
    let shapes = ProceduralShapes::new(config.seed, config.data.shapes, None).unwrap();
    TrainingPairs::new(config, Box::new(shapes)).unwrap()
}

fn network(config: &TrainConfig, device: &Device) -> Srrf {
    init::seeded(config.network.init(device), config.seed)
}

struct Cast(DType);

impl ModuleMapper for Cast {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (id, tensor, mapper) = param.consume();
        Param::from_mapped_value(id, tensor.cast(self.0), mapper)
    }
}

/// The gradient of every parameter by its path.
struct Gradients {
    all: GradientsParams,
    path: Vec<String>,
    found: Numbers,
}

impl ModuleVisitor for Gradients {
    fn enter_module(&mut self, name: &str, _container_type: &str) {
        self.path.push(name.to_string());
    }

    fn exit_module(&mut self, _name: &str, _container_type: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        if let Some(gradient) = self.all.remove::<D>(param.id) {
            self.found.insert(self.path.join("."), values(&gradient));
        }
    }
}

fn values<const D: usize>(tensor: &Tensor<D>) -> Vec<f64> {
    tensor.try_to_vec_as::<f64>().unwrap()
}

/// Poses, matches and skeletons of some pairs, and the gradient of the sum of all losses.
fn pass(device: &Device, dtype: DType) -> (Numbers, Numbers) {
    let config = config();
    let pairs = pairs(&config).shard(0, PAIRS).unwrap();
    let (_, batch) = to_batch(&pairs, PHASE, device).unwrap();
    let TrainingBatch { source, target, rotation, translation, .. } = batch;
    let (source, target) = (source.cast(dtype), target.cast(dtype));
    let (rotation, translation) = (rotation.cast(dtype), translation.cast(dtype));
    let model = network(&config, device).map(&mut Cast(dtype)).train();
    let output = model.forward(&config.network.integration, source.clone(), target.clone(), PHASE).unwrap();

    let mut found = Numbers::new();
    let fused = (output.fused.rotation.clone(), output.fused.translation.clone());
    let mut total =
        registration_loss(fused.0.clone(), fused.1.clone(), rotation.clone(), translation.clone());
    found.insert("fused rotation".into(), values(&fused.0.detach()));
    found.insert("fused translation".into(), values(&fused.1.detach()));
    for (name, branch) in [("dense", &output.dense), ("skeleton", &output.skeleton)] {
        let (r, t) = (branch.rotation.clone(), branch.translation.clone());
        found.insert(format!("{name} rotation"), values(&r.clone().detach()));
        found.insert(format!("{name} translation"), values(&t.clone().detach()));
        found.insert(format!("{name} matches"), values(&branch.matches.clone().detach()));
        let (points, matches) = (branch.source_points.clone(), branch.matches.clone());
        total = total
            + registration_loss(r, t, rotation.clone(), translation.clone())
            + correspondence_loss(points, matches, rotation.clone(), translation.clone());
    }
    found.insert("skeleton".into(), values(&output.source_skeleton.points.clone().detach()));
    found.insert("radii".into(), values(&output.source_skeleton.radii.clone().detach()));
    let (x, y) = ((source, &output.source_skeleton), (target, &output.target_skeleton));
    total = total + skeleton_loss(&config.losses.skeleton, x, y, rotation, translation).unwrap().total;

    let all = GradientsParams::from_grads(total.backward(), &model);
    let mut gradients = Gradients { all, path: Vec::new(), found: Numbers::new() };
    model.visit(&mut gradients);
    (found, gradients.found)
}

/// The loss of each of five training steps, and what every parameter moved. The shards of a batch go to the devices
/// in turn.
fn train(devices: &[Device]) -> (Vec<f64>, Vec<f64>) {
    let config = config();
    let (pairs, workers) = (pairs(&config), Workers::new(2).unwrap());
    let stage = config.stages.iter().find(|stage| stage.trains.registration).unwrap();
    let context =
        StepContext { config: &config, stage, pairs: &pairs, devices, prefetch: None, stopped: &|| false };
    let mut model = network(&config, &devices[0]).valid();
    let mut updater = Updater::new(optimizer(&config.optimizer), &model);
    let start = flat(&model);
    let mut losses = Vec::new();
    for step in 0..STEPS {
        let outcome = gradient(&context, &model, step, &workers).unwrap().unwrap();
        losses.push(outcome.losses["total"]);
        let rate = context.stage.learning_rate;
        model = updater.step(rate, model, outcome.gradients);
    }
    (losses, flat(&model).iter().zip(start).map(|(after, before)| after - before).collect())
}

fn flat(model: &Srrf) -> Vec<f64> {
    parameters(model).unwrap().into_values().flat_map(|(_, values)| values).map(f64::from).collect()
}

fn largest(numbers: &[f64]) -> f64 {
    numbers.iter().fold(0.0, |most, v| if v.abs() > most || v.is_nan() { v.abs() } else { most })
}

/// Largest difference; not a number if any of them is not.
fn apart(ours: &[f64], wanted: &[f64]) -> f64 {
    assert_eq!(ours.len(), wanted.len());
    largest(&ours.iter().zip(wanted).map(|(a, b)| a - b).collect::<Vec<_>>())
}

/// Compares what two devices gave by name; differences count in shares of the largest number under
/// the name, but of no less than `least` times the largest of all. Gives the largest share and whose it is.
fn compare(what: &str, (ours, wanted): (&Numbers, &Numbers), least: f64) -> (f64, String) {
    assert!(ours.keys().eq(wanted.keys()), "{what}: other names");
    let most = wanted.values().map(|numbers| largest(numbers)).fold(0.0, f64::max);
    // Without its sign, so that what is not a number comes out as the largest.
    let share =
        |name: &String, wanted| (apart(&ours[name], wanted) / largest(wanted).max(least * most)).abs();
    let shares = wanted.iter().map(|(name, wanted)| (share(name, wanted), name.clone()));
    shares.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
}

/// What was compared, how far it is apart, and how far it may be.
struct Measured {
    what: String,
    apart: f64,
    allowed: f64,
}

/// Prints all that was measured, and then fails if any of it is too far apart.
fn hold(measured: &[Measured]) {
    for Measured { what, apart, allowed } in measured {
        eprintln!("{what}: {apart:.1e} apart, {allowed:.1e} allowed");
    }
    let within = |m: &Measured| m.apart <= m.allowed; // not so if it is not a number
    let failed: Vec<&str> = measured.iter().filter(|m| !within(m)).map(|m| m.what.as_str()).collect();
    assert!(failed.is_empty(), "too far apart: {failed:?}");
}

/// A device against flex.
fn agrees(name: &str, device: &Device, dtype: DType) -> Vec<Measured> {
    let (wanted, wanted_gradients) = pass(&Device::flex(), DType::F32);
    assert!(wanted.len() == 10 && wanted_gradients.len() > 50, "something to compare");
    let (found, gradients) = pass(device, dtype);
    let tolerances = Tolerances::of(name);
    let (forward, of) = compare(name, (&found, &wanted), 0.0);
    let forward =
        Measured { what: format!("{name}, forward, {of}"), apart: forward, allowed: tolerances.forward };
    // Some gradients are 0 by construction and come out as what rounding leaves.
    let (backward, of) = compare(name, (&gradients, &wanted_gradients), 1e-2);
    let backward =
        Measured { what: format!("{name}, gradient of {of}"), apart: backward, allowed: tolerances.gradient };
    vec![forward, backward]
}

/// Five training steps on devices against flex.
fn trains(name: &str, devices: &[Device]) -> Vec<Measured> {
    let (wanted, wanted_moved) = train(&[Device::flex()]);
    let (found, moved) = train(devices);
    let losses = largest(&found.iter().zip(&wanted).map(|(a, b)| (a - b) / b).collect::<Vec<_>>());
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let difference: Vec<f64> = moved.iter().zip(&wanted_moved).map(|(a, b)| a - b).collect();
    let moved = norm(&difference) / norm(&wanted_moved);
    let &Tolerances { losses: of_losses, moved: of_moved, .. } = Tolerances::of(name);
    vec![
        Measured { what: format!("{name}, losses of {STEPS} steps"), apart: losses, allowed: of_losses },
        Measured { what: format!("{name}, parameters after them"), apart: moved, allowed: of_moved },
    ]
}

/// The whole suite on a device of this program, if this machine can run it.
#[allow(dead_code, reason = "the default build has flex alone")]
fn suite(name: &str) {
    let required = std::env::var("SRRF_REQUIRE_DEVICE").is_ok_and(|wanted| wanted == name);
    match srrf_model::device(name) {
        Ok(device) => {
            let mut measured = agrees(name, &device, DType::F32);
            measured.extend(trains(name, std::slice::from_ref(&device)));
            let by_turns = [device, Device::flex()];
            measured.extend(trains(&format!("{name} and flex by turns"), &by_turns));
            hold(&measured);
        }
        Err(e) if required => panic!("{e}"),
        Err(e) => eprintln!("skipped: {e}"),
    }
}

#[test]
fn flex_with_burns_own_operations_in_f64_agrees() {
    hold(&agrees("flex in f64", &Device::flex(), DType::F64));
}

#[test]
fn five_steps_teach_something() {
    let (losses, moved) = train(&[Device::flex()]);
    assert!(losses.len() == STEPS && largest(&moved) > 1e-3, "{losses:?}");
}

#[test]
fn shards_on_two_devices_give_the_steps_of_one() {
    // A copy of the network for each, of the same kind here: the same bytes.
    let two = train(&[Device::flex(), Device::flex()]);
    assert_eq!(two, train(&[Device::flex()]));
}

#[test]
fn what_is_done_ahead_of_a_step_changes_nothing() {
    let mut config = config();
    for stage in &mut config.stages {
        stage.trains = SrrfParts { sem: SemTraining::Frozen, registration: true };
    }
    let (pairs, device) = (pairs(&config), Device::flex());
    let (stage, model) = (&config.stages[0], network(&config, &device).valid());
    let gradients = |ahead: bool| {
        let prepared = prepare(&config, stage, &pairs, 1, &device).unwrap();
        let PreparedBatch { batch, layout } =
            if ahead { prepared.prefetched(&config, &model).unwrap() } else { prepared };
        assert_eq!(matches!(layout, Layout::Registration(_)), ahead);
        let (all, losses) =
            config.network.gradient(&config.losses, &stage.trains, &model, batch, layout).unwrap();
        let mut gradients = Gradients { all, path: Vec::new(), found: Numbers::new() };
        model.visit(&mut gradients);
        (gradients.found, losses)
    };
    let (found, losses) = gradients(true);
    assert!(found.len() > 50 && losses.len() > 5, "something to compare");
    assert_eq!((found, losses), gradients(false));
}

#[test]
fn a_step_is_left_out_where_the_run_is_to_stop() {
    let config = config();
    let (pairs, workers, devices) = (pairs(&config), Workers::new(1).unwrap(), [Device::flex()]);
    let asked = std::sync::atomic::AtomicUsize::new(0);
    // The first shard goes through; the second, and with it the step, does not.
    let stopped = || asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed) > 0;
    let stage = &config.stages[2];
    let context = StepContext {
        config: &config,
        stage,
        pairs: &pairs,
        devices: &devices,
        prefetch: None,
        stopped: &stopped,
    };
    let model = network(&config, &devices[0]).valid();
    assert!(gradient(&context, &model, 0, &workers).unwrap().is_none());
    assert_eq!(asked.into_inner(), 2);
}

#[cfg(feature = "ndarray")]
#[test]
fn ndarray_agrees() {
    suite("ndarray");
}

#[cfg(feature = "wgpu")]
#[test]
fn wgpu_agrees() {
    suite("wgpu");
}

#[cfg(feature = "vulkan")]
#[test]
fn vulkan_agrees() {
    suite("vulkan");
}

#[cfg(feature = "cuda")]
#[test]
fn cuda_agrees() {
    suite("cuda");
}

#[cfg(feature = "libtorch")]
#[test]
fn libtorch_agrees() {
    suite("libtorch");
}
