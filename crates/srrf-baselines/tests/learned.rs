//! What every learned baseline must do, at small sizes on built-in shapes: answer with a motion, not mind
//! the order of the points, learn, and come back from a file.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::collections::BTreeMap;

use burn::module::Module;
use burn::optim::{AdamConfig, GradientsParams};
use burn::tensor::{Device, Tensor, TensorData};
use srrf_baselines::{
    DcpConfig, DcpLosses, DcpVersion, EquiGsprConfig, EquiGsprLosses, LearnedConfig, LearnedRegister,
    LkJacobian, PanetConfig, PanetLosses, PointNetLkConfig, PointNetLkLosses, RgmConfig, RgmLosses,
};
use srrf_cloud::{EulerXyz, PointCloud, Register, Rigid};
use srrf_corrupt::datasets::ShapeSource;
use srrf_corrupt::shapes::ProceduralShapes;
use srrf_model::{NetworkConfig, PairBatch, TrainingBatch, init, weights};

const POINTS: usize = 97;
/// More than there are: every point is a token.
const ALL: usize = 0;

fn dcp(version: DcpVersion) -> (DcpConfig, DcpLosses) {
    let config = DcpConfig {
        version,
        tokens: ALL,
        neighbours: 7,
        widths: vec![16, 24],
        width: 32,
        heads: 4,
        feed_forward: 48,
    };
    (config, DcpLosses { registration: 1.0 })
}

fn pointnetlk(jacobian: LkJacobian) -> (PointNetLkConfig, PointNetLkLosses) {
    let config = PointNetLkConfig {
        points: ALL,
        widths: vec![24, 40, 96],
        jacobian,
        iterations: 5,
        test_iterations: 6,
    };
    (config, PointNetLkLosses { residual: 1.0, pose: 16.0 })
}

fn panet() -> (PanetConfig, PanetLosses) {
    let config = PanetConfig {
        tokens: ALL,
        scales: vec![9, 5],
        widths: vec![16, 24],
        width: 32,
        head: vec![48, 24],
        iterations: 2,
    };
    (config, PanetLosses { points: 1.0 })
}

fn rgm() -> (RgmConfig, RgmLosses) {
    let config = RgmConfig {
        tokens: ALL,
        neighbours: 7,
        widths: vec![16, 24],
        width: 24,
        heads: 4,
        feed_forward: 48,
        sinkhorn: 11,
        match_radius: 0.05,
        ..RgmConfig::default()
    };
    (config, RgmLosses { assignment: 1.0 })
}

fn equi_gspr() -> (EquiGsprConfig, EquiGsprLosses) {
    let config =
        EquiGsprConfig { tokens: POINTS + 3, kept: 61, feature_radius: 0.6, ..EquiGsprConfig::default() };
    (config, EquiGsprLosses { rotation: 1.0, translation: 1.0, scores: 1.0, similarity: 1.0 })
}

/// Three shapes with their posed copies, in another order.
fn pairs() -> Vec<(PointCloud, PointCloud, Rigid)> {
    let shapes = ProceduralShapes::new(21, 9, None).unwrap();
    (0..3)
        .map(|i| {
            let angles = [20.0 - 7.0 * i as f64, 5.0 + 9.0 * i as f64, -15.0];
            let pose = Rigid {
                rotation: EulerXyz::from_deg(angles).to_matrix(),
                translation: [0.1, -0.2, 0.05 * i as f64].into(),
            };
            let source = cloud(&shapes, i);
            let moved = source.transformed(&pose);
            let target = (0..POINTS).map(|k| moved.points()[(k * 31 + 5) % POINTS]).collect();
            (source, PointCloud::new(target).unwrap(), pose)
        })
        .collect()
}

fn cloud(shapes: &ProceduralShapes, index: usize) -> PointCloud {
    use rand::SeedableRng;
    shapes.sample(index, POINTS, &mut rand::rngs::ChaCha8Rng::seed_from_u64(7)).unwrap()
}

fn training_batch(device: &Device) -> TrainingBatch {
    let pairs = pairs();
    let clouds: Vec<(&PointCloud, &PointCloud)> = pairs.iter().map(|(s, t, _)| (s, t)).collect();
    let poses: Vec<Rigid> = pairs.iter().map(|(_, _, pose)| *pose).collect();
    TrainingBatch::new(&PairBatch::new(&clouds, device).unwrap(), &poses, 0.3)
}

fn values<const D: usize>(tensor: &Tensor<D>) -> Vec<f64> {
    tensor.try_to_vec_as::<f64>().unwrap()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Shapes, proper rotations, one row for one pair, and no regard to the order of the points.
fn answers<C: LearnedConfig>(config: &C) {
    let device = Device::flex();
    config.check().unwrap();
    let network = init::seeded(config.init(&device), 3);
    let TrainingBatch { source, target, .. } = training_batch(&device);
    let pose = config.pose(&network, source.clone(), target.clone()).unwrap();
    assert_eq!((pose.rotation.dims(), pose.translation.dims()), ([3, 3, 3], [3, 3]));
    let square = pose.rotation.clone().matmul(pose.rotation.clone().transpose());
    for (i, v) in values(&square).iter().enumerate() {
        assert!((v - f64::from(i % 9 % 4 == 0)).abs() < 1e-3, "{}: {v} at {i}", C::NAME);
    }
    let alone =
        config.pose(&network, source.clone().narrow(0, 1, 1), target.clone().narrow(0, 1, 1)).unwrap();
    let together = values(&pose.rotation.clone().narrow(0, 1, 1));
    assert!(largest_difference(&values(&alone.rotation), &together) < 1e-4, "{}", C::NAME);

    let order: Vec<i64> = (0..POINTS).map(|k| ((k * 40 + 11) % POINTS) as i64).collect();
    let order = Tensor::from_data(TensorData::new(order, [POINTS]), &device);
    let shuffled = config.pose(&network, source.select(1, order), target).unwrap();
    let apart = largest_difference(&values(&shuffled.rotation), &values(&pose.rotation));
    assert!(apart < 2e-3, "{}: {apart}", C::NAME);
}

/// The sum of the losses falls to `share` of what it was within `steps`.
fn learns<C: LearnedConfig>((config, losses): &(C, C::Losses), rate: f64, steps: usize, share: f64) {
    let device = Device::flex();
    let batch = training_batch(&device);
    let mut network = init::seeded(config.init(&device), 3);
    let mut adam = AdamConfig::new().init();
    let mut course = Vec::new();
    for _ in 0..steps {
        let learning = network.train();
        let terms = config.losses(losses, &learning, &batch).unwrap();
        assert_eq!(terms.iter().map(|t| t.0).collect::<Vec<_>>(), C::TERMS);
        let total = terms.into_iter().map(|(_, value, weight)| value * weight).reduce(|a, b| a + b).unwrap();
        course.push(total.clone().into_scalar::<f64>());
        let gradients = GradientsParams::from_grads(total.backward(), &learning);
        network = adam.step(rate, learning, gradients).valid();
    }
    let (first, last) = (course[0], course[steps - 4..].iter().sum::<f64>() / 4.0);
    assert!(last < share * first, "{}: {first} to {last}: {course:.3?}", C::NAME);
}

/// From bytes comes the same method; the bytes of another method are refused.
fn survives_a_file<C: LearnedConfig + 'static, Other: LearnedConfig>(config: &C) {
    let device = Device::flex();
    let network = init::seeded(config.init(&device), 4);
    let bytes = weights::to_safetensors(&network, config, "tiny", &BTreeMap::new()).unwrap();
    let register = |bytes: &[u8]| {
        let loaded = weights::parse::<C>(bytes, "memory", &device).unwrap();
        assert_eq!(&loaded.config, config);
        LearnedRegister::new(loaded, device.clone())
    };
    let (source, target, _) = &pairs()[0];
    let a = register(&bytes).register(source, target).unwrap();
    let b = register(&bytes).register(source, target).unwrap();
    assert_eq!((a.target_from_source, a.iterations), (b.target_from_source, config.passes()));
    assert_eq!(register(&bytes).name(), C::NAME);
    let wrong = weights::parse::<Other>(&bytes, "memory", &device).err().unwrap().to_string();
    assert!(wrong.contains(Other::KEY), "{wrong}");
    let line = PointCloud::new((0..POINTS).map(|i| [i as f64, 0.0, 0.0]).collect()).unwrap();
    assert!(register(&bytes).register(&line, target).is_err());
}

#[test]
fn dcp_v1() {
    let both = dcp(DcpVersion::V1);
    answers(&both.0);
    survives_a_file::<_, RgmConfig>(&both.0);
    learns(&both, 3e-3, 40, 0.7);
}

#[test]
fn dcp_v2() {
    let both = dcp(DcpVersion::V2);
    answers(&both.0);
    survives_a_file::<_, PanetConfig>(&both.0);
    learns(&both, 3e-3, 40, 0.7);
}

#[test]
fn pointnetlk_with_both_jacobians() {
    for jacobian in [LkJacobian::FiniteDifference, LkJacobian::Analytic] {
        let both = pointnetlk(jacobian);
        answers(&both.0);
        survives_a_file::<_, DcpConfig>(&both.0);
        learns(&both, 2e-3, 40, 0.9);

        // Equal clouds have equal features: nothing moves.
        let device = Device::flex();
        let source = training_batch(&device).source;
        let network = init::seeded(both.0.init(&device), 3);
        let pose = both.0.pose(&network, source.clone(), source).unwrap();
        assert!(values(&pose.translation).iter().all(|v| v.abs() < 1e-6));
    }
}

#[test]
fn panet_style() {
    let both = panet();
    answers(&both.0);
    survives_a_file::<_, DcpConfig>(&both.0);
    learns(&both, 3e-3, 40, 0.7);
}

#[test]
fn graph_matching() {
    let both = rgm();
    answers(&both.0);
    survives_a_file::<_, DcpConfig>(&both.0);
    learns(&both, 3e-3, 40, 0.9);
}

#[test]
fn equi_gspr_style() {
    let both = equi_gspr();
    answers(&both.0);
    survives_a_file::<_, DcpConfig>(&both.0);
    learns(&both, 3e-3, 40, 0.8);

    // A turned source gives the same matches, with the same features: the pose turns along.
    let device = Device::flex();
    let network = init::seeded(both.0.init(&device), 3);
    let TrainingBatch { source, target, .. } = training_batch(&device);
    let turn = EulerXyz::from_deg([70.0, -40.0, 110.0]).to_matrix();
    let turn: Vec<f64> = turn.transpose().iter().copied().collect();
    let turn = Tensor::<3>::from_data(TensorData::new(turn, [1, 3, 3]), &device).repeat_dim(0, 3);
    let turned = source.clone().matmul(turn.clone().transpose());
    let before = both.0.pose(&network, source, target.clone()).unwrap();
    let after = both.0.pose(&network, turned, target).unwrap();
    let apart = largest_difference(&values(&after.rotation.matmul(turn)), &values(&before.rotation));
    assert!(apart < 1e-2, "{apart}");
}

#[test]
fn sizes_that_cannot_be_are_named() {
    let wrong = |config: Result<(), srrf_model::WrongSize>| config.err().unwrap().key;
    assert_eq!(wrong(DcpConfig { heads: 5, ..DcpConfig::default() }.check()), "heads");
    assert_eq!(
        wrong(PointNetLkConfig { widths: vec![7, 5], ..PointNetLkConfig::default() }.check()),
        "widths"
    );
    assert_eq!(wrong(PanetConfig { scales: vec![8, 16], ..PanetConfig::default() }.check()), "scales");
    assert_eq!(wrong(RgmConfig { match_radius: 0.0, ..RgmConfig::default() }.check()), "match_radius");
    assert_eq!(wrong(EquiGsprConfig { kept: 300, ..EquiGsprConfig::default() }.check()), "kept");
}
