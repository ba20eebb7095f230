//! scratch
use mrt_tests::Bounces;
use mrt_tests::error_measure::*;
use mrt_tests::exact::*;
use mrt_tests::exact::direct::*;
use mrt_tests::exact::solve::*;
use mrt_tests::exact::transport::*;
use mrt_tests::oracle_file::*;

fn pool(v: &[f64], n: usize, p: usize) -> Vec<f64> {
    let mut out = vec![0.0; v.len() / p / p];
    for (k, x) in v.iter().enumerate() {
        let (w, j, i) = (k / n / n, k / n % n, k % n);
        out[w * (n / p) * (n / p) + j / p * (n / p) + i / p] += x;
    }
    out
}

#[test]
fn pooled() {
    let folder = oracle_folder().unwrap();
    for (name, fine) in [("cube",1), ("corridor5", 1), ("maze11", 1)] {
        let f = read(&folder.join(format!("{name}.json"))).unwrap();
        for s in [fine] {
            if s == 1 && fine == 1 && false { continue; }
            let n = 16 * s;
            let scene = ExactScene::from_cells(&f.cells, n).unwrap();
            let t = Transport::build(&scene);
            for light in 0..f.lights.len() {
                let l = PointLight::unit(f.lights[light]);
                let mean = direct_quarters(&scene, &l, 4);
                for (label, b, a) in [("first", Bounces::First, 1.0), ("count2", Bounces::Count(2), 1.0), ("count6@.9", Bounces::Count(6), 0.9), ("all@.5", Bounces::All, 0.5)] {
                    let albedo = vec![a; scene.texel_count()];
                    let e = solve(&scene, &t, &mean, b, &albedo).unwrap();
                    let e: Vec<f64> = (0..f.walls.len() * 256).map(|k| { let (w, j, i) = (k / 256, k / 16 % 16, k % 16); e[w * n * n + (j * s + s / 2) * n + i * s + s / 2] }).collect();
                    let r = f.indirect_irradiance(light, b, a).unwrap();
                    let hops = f.hops(light).unwrap();
                    let h4 = rel_l2_by_hop(&pool(&e, 16, 4), &pool(&r, 16, 4), &hops).map(|h| (h.unwrap_or(0.0) * 1e4).round() / 100.0);
                    println!("{name} {n} {light} {label:10} full {:.3} pooled2 {:.3} pooled4 {:.3} pooled8 {:.3} pooled16 {:.3} {h4:?}", 100.0 * rel_l2(&e, &r), 100.0 * rel_l2(&pool(&e, 16, 2), &pool(&r, 16, 2)), 100.0 * rel_l2(&pool(&e, 16, 4), &pool(&r, 16, 4)), 100.0 * rel_l2(&pool(&e, 16, 8), &pool(&r, 16, 8)), 100.0 * rel_l2(&pool(&e, 16, 16), &pool(&r, 16, 16)));
                }
            }
        }
    }
}
