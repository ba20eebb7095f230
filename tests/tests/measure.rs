//! scratch: measured table
use mrt_tests::Bounces;
use mrt_tests::error_measure::*;
use mrt_tests::exact::*;
use mrt_tests::exact::direct::*;
use mrt_tests::exact::solve::*;
use mrt_tests::exact::transport::*;
use mrt_tests::oracle_file::*;
use std::time::Instant;

fn show(name: &str, light: usize, term: &str, a: &[f64], r: &[f64], hops: &[u32]) -> f64 {
    let e = rel_l2(a, r);
    let by: Vec<String> = rel_l2_by_hop(a, r, hops).iter().map(|h| h.map_or("-".into(), |h| format!("{:.2}", h * 100.0))).collect();
    println!("{name:18} {light} {term:10} {:.3}  [{}]", e * 100.0, by.join(" "));
    e
}

#[test]
fn measure() {
    let folder = oracle_folder().unwrap();
    let n: usize = std::env::var("SUB").ok().and_then(|s| s.parse().ok()).unwrap_or(4);
    for name in ["cube", "corridor5", "l_turn", "t_junction", "room3x3", "stack3", "maze11", "cube_cornell", "cube_one_white", "corridor5_painted"] {
        let f = read(&folder.join(format!("{name}.json"))).unwrap();
        let scene = ExactScene::from_cells(&f.cells, f.resolution.unwrap()).unwrap();
        let t0 = Instant::now();
        let t = Transport::build(&scene);
        println!("{name} build {:.2}s {:.0} MB", t0.elapsed().as_secs_f64(), t.bytes() as f64 / 1e6);
        for light in 0..f.lights.len() {
            let l = PointLight::unit(f.lights[light]);
            let hops = f.hops(light).unwrap();
            let mean = direct_quarters(&scene, &l, n);
            match &f.kind {
                Kind::Irradiance => {
                    show(name, light, "direct", &direct(&scene, &l), &f.term(light, 0).unwrap(), &hops);
                    for (label, b, a) in [("first", Bounces::First, 1.0), ("count2", Bounces::Count(2), 1.0), ("count6@.9", Bounces::Count(6), 0.9), ("all@.5", Bounces::All, 0.5), ("all@.9", Bounces::All, 0.9)] {
                        let albedo = vec![a; scene.texel_count()];
                        let t0 = Instant::now();
                        let e = solve(&scene, &t, &mean, b, &albedo).unwrap();
                        let time = t0.elapsed().as_secs_f64();
                        show(name, light, &format!("{label} {time:.2}s"), &e, &f.indirect_irradiance(light, b, a).unwrap(), &hops);
                    }
                }
                Kind::IrradianceRgb { albedo } => {
                    let albedo = scene.spread_over_texels(albedo).unwrap();
                    for (label, b) in [("first", Bounces::First), ("count10", Bounces::Count(10)), ("all", Bounces::All)] {
                        let e = solve_rgb(&scene, &t, &mean, b, &albedo).unwrap();
                        let r = f.indirect_irradiance_rgb(light, b).or_else(|_| f.indirect_irradiance_rgb(light, Bounces::All)).unwrap();
                        show(name, light, label, e.as_flattened(), r.as_flattened(), &hops);
                    }
                }
                _ => unreachable!(),
            }
        }
    }
}
