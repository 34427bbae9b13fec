//! scratch
use burn::optim::GradientsParams;
use burn::prelude::*;
use srrf_model::*;
use std::time::Instant;
pub fn small() -> SrrfConfig {
    let sfe = |k| SfeConfig { layers: 3, neighbours: k, width: 64, heads: 4, mlp: 128 };
    let pfi = PfiConfig { blocks: 1, heads: 4, feed_forward: 384, position_hidden: 256, squeeze: 16 };
    SrrfConfig {
        sem: SemConfig {
            levels: vec![
                LevelConfig { points: 256, neighbours: 16, widths: vec![32, 64] },
                LevelConfig { points: 256, neighbours: 16, widths: vec![128] },
            ],
            global: 256,
            head: vec![256, 128],
            skeleton_points: 64,
            logit_scale: 5.0,
        },
        dense: BranchConfig { tokens: 128, sfe: sfe(16), pfi: pfi.clone() },
        skeleton: BranchConfig { tokens: 0, sfe: sfe(8), pfi },
        integration: IntegrationConfig {
            test: InlierTest::Nearest,
            dense_threshold: 0.05,
            skeleton_threshold: 0.05,
            sharpness: 1.0,
        },
    }
}
fn main() {
    unsafe { libc_mallopt() };
    let dev = Device::flex();
    let cfg = small();
    let model = init::seeded(cfg.init(&dev), 1).valid();
    println!(
        "params sem {} dense {} skel {}",
        model.sem.num_params(),
        model.dense.num_params(),
        model.skeleton.num_params()
    );
    let b: usize = std::env::args().nth(1).map_or(8, |s| s.parse().unwrap());
    let mut s = 1u64;
    let mut rnd = || {
        s = s.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((s >> 33) as f64 / (1u64 << 31) as f64 - 0.5) as f32
    };
    let v: Vec<f32> = (0..b * 1024 * 3).map(|_| rnd()).collect();
    let w: Vec<f32> = (0..b * 1024 * 3).map(|_| rnd()).collect();
    let x = Tensor::<3>::from_data(TensorData::new(v, [b, 1024, 3]), &dev);
    let y = Tensor::<3>::from_data(TensorData::new(w, [b, 1024, 3]), &dev);
    let eye = Tensor::<2>::eye(3, &dev).unsqueeze::<3>().repeat_dim(0, b);
    let z = Tensor::<2>::zeros([b, 3], &dev);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let lc = SkeletonLossConfig { point_to_sphere: 0.3, radius: 0.4, distribution: 0.25, index_match: 0.0 };
    pool.install(|| {
        for _ in 0..4 {
            let t = Instant::now();
            let m = model.sem.clone().train();
            let a = m.forward(x.clone());
            let c = m.forward(y.clone());
            let t1 = t.elapsed();
            let l = skeleton_loss(&lc, (x.clone(), &a), (y.clone(), &c), eye.clone(), z.clone());
            let t2 = t.elapsed();
            let g = GradientsParams::from_grads(l.total.backward(), &m);
            println!("sem fwd {:?} loss {:?} bwd {:?} ({} grads)", t1, t2 - t1, t.elapsed() - t2, g.len());
            for (n, br, p, q) in [
                ("dense", &model.dense, x.clone(), y.clone()),
                ("skel", &model.skeleton, a.points.detach(), c.points.detach()),
            ] {
                let m = br.clone().train();
                let t = Instant::now();
                let o = m.forward(p.inner_or(), q.inner_or(), 0.3);
                let l = registration_loss(o.rotation.clone(), o.translation.clone(), eye.clone(), z.clone())
                    + correspondence_loss(o.source_points, o.matches, eye.clone(), z.clone());
                let t1 = t.elapsed();
                let g = GradientsParams::from_grads(l.backward(), &m);
                println!("{n} fwd {:?} bwd {:?} ({} grads)", t1, t.elapsed() - t1, g.len());
            }
            let t = Instant::now();
            let o = model.forward(&cfg.integration, x.clone(), y.clone(), 0.5);
            println!("inference {:?} lambda {:?}", t.elapsed(), &o.fused.lambda[..1]);
        }
    });
}
unsafe fn libc_mallopt() {
    unsafe extern "C" {
        fn mallopt(p: i32, v: i32) -> i32;
    }
    unsafe {
        mallopt(-3, 1 << 30);
        mallopt(-1, i32::MAX);
        mallopt(-2, 64 << 20);
    }
}
trait InnerOr {
    fn inner_or(self) -> Self;
}
impl InnerOr for Tensor<3> {
    fn inner_or(self) -> Self {
        if self.is_autodiff() { self.inner() } else { self }
    }
}
