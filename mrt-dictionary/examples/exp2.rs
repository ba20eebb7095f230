use glam::*;
use mrt_dictionary::{bake::bake, config::*, progress::Progress};
use mrt_runtime::{assemble::*, frame::*, level::*, light::*, visibility::Openings};
fn env(k: &str, d: f64) -> f64 {
    std::env::var(k)
        .ok()
        .and_then(|v| v.parse().ok())
        .unwrap_or(d)
}
fn main() {
    let t = std::time::Instant::now();
    let cfg = BakeConfig {
        preset: "x".into(),
        resolution: env("RES", 16.) as usize,
        modes: env("KB", 32.) as usize,
        prior: PriorConfig {
            lights_per_axis: env("LPA", 6.) as usize,
            light_radius: 0.1,
            k_d: env("KD", 100000.) as usize,
        },
        enrichment: (env("EW", 0.2) > 0.).then(|| Enrichment {
            constant_weight: env("CW", env("EW", 0.2)),
            indirect_weight: env("EW", 0.2),
        }),
        lightfield: LightfieldConfig {
            positions: env("LP", 12.) as usize,
            directions: env("LD", 24.) as usize,
            super_samples: env("SS", 3.) as usize,
            lightfield_modes: env("KRLF", 128.) as usize,
            response_modes: env("KR", 32.) as usize,
            enrichment_rounds: env("ER", 1.) as usize,
            enrichment_weight: env("IW", 1.),
        },
    };
    let last = std::sync::Mutex::new(std::time::Instant::now());
    let rep = |s: &str, _: usize, _: usize| {
        let mut l = last.lock().unwrap();
        if env("V", 0.) > 0. {
            eprintln!("  +{:.2} {s}", l.elapsed().as_secs_f64());
        }
        *l = std::time::Instant::now();
    };
    let no = std::sync::atomic::AtomicBool::new(false);
    let d = bake(&cfg, &Progress::new(&rep, &no)).unwrap();
    println!(
        "bake {:.1}s {} KB",
        t.elapsed().as_secs_f64(),
        d.bytes() / 1024
    );
    let mut all = [(0.0, 0usize); 5];
    for f in [
        "cube",
        "corridor5",
        "l_turn",
        "t_junction",
        "room3x3",
        "maze11",
    ] {
        let j: serde_json::Value = serde_json::from_str(
            &std::fs::read_to_string(format!("/work/shared/oracle/{f}.json")).unwrap(),
        )
        .unwrap();
        let raw = std::fs::read(format!("/work/shared/oracle/{f}.f32")).unwrap();
        let data: Vec<f64> = raw
            .chunks_exact(4)
            .map(|c| f32::from_le_bytes(c.try_into().unwrap()) as f64)
            .collect();
        let cells: Vec<[i32; 3]> = serde_json::from_value(j["cells"].clone()).unwrap();
        let lights: Vec<[f32; 3]> = serde_json::from_value(j["lights"].clone()).unwrap();
        let shape: Vec<usize> = serde_json::from_value(j["shape"].clone()).unwrap();
        let level = Level::from_cells(&cells, Vec3::ONE).unwrap();
        let ta = std::time::Instant::now();
        let scene = assemble(
            &level,
            &d,
            &AssembleConfig {
                max_depth: env("DM", 8.) as usize,
            },
        )
        .unwrap();
        let ta = ta.elapsed();
        let mut frame = Frame::new(&scene);
        let n = shape[2] * 256;
        let mut mean = [(0.0, 0usize); 5];
        for (l, p) in lights.iter().enumerate() {
            frame
                .solve(
                    &scene,
                    &[Light::Sphere {
                        position: Vec3::from_array(*p),
                        radius: 0.0,
                        intensity: Vec3::ONE,
                    }],
                    &Openings,
                    Bounces::Count(1),
                )
                .unwrap();
            // hops
            let lb = scene
                .block_at(DVec3::from_array(p.map(f64::from)), 1e-6)
                .unwrap();
            let mut hop = vec![99usize; cells.len()];
            hop[lb] = 0;
            for _ in 0..20 {
                for i in 0..cells.len() {
                    for k in 0..cells.len() {
                        let dd: i32 = (0..3).map(|a| (cells[i][a] - cells[k][a]).abs()).sum();
                        if dd == 1 && hop[i] > hop[k] + 1 {
                            hop[i] = hop[k] + 1;
                        }
                    }
                }
            }
            let mut num = [0.0; 5];
            let mut den = [0.0; 5];
            let mut w = 0;
            for (b, block) in scene.blocks.iter().enumerate() {
                // oracle order: turned faces in order
                for face in mrt_core::cube::Face::ALL {
                    let cf = block.orientation.inverse().face(face);
                    let Some(off) = block.shape.wall_offset(cf, 16) else {
                        continue;
                    };
                    for jj in 0..16 {
                        for ii in 0..16 {
                            let c = block
                                .orientation
                                .inverse()
                                .point(face.texel_center(16, jj, ii));
                            let a = |ax: usize| ((c[ax] * 16.0) as usize).min(15);
                            let k = off + a(cf.v_axis()) * 16 + a(cf.u_axis());
                            let e = frame.indirect()[3 * block.texels.start + k] as f64;
                            let r = data[(l * 7 + 1) * n + w * 256 + jj * 16 + ii];
                            let h = hop[b].min(3) + 1;
                            for q in [0, h] {
                                num[q] += (e - r).powi(2);
                                den[q] += r * r;
                            }
                        }
                    }
                    w += 1;
                }
            }
            for q in 0..5 {
                if den[q] > 0.0 {
                    let v = 100.0 * (num[q] / den[q]).sqrt();
                    mean[q].0 += v;
                    mean[q].1 += 1;
                    all[q].0 += v;
                    all[q].1 += 1;
                }
            }
        }
        println!(
            "{f:12} {} assemble {:.0} ms",
            mean.map(|(s, n)| if n > 0 {
                format!("{:6.2}", s / n as f64)
            } else {
                "   -  ".into()
            })
            .join(" "),
            ta.as_secs_f64() * 1e3
        );
    }
    println!(
        "{:12} {}",
        "mean",
        all.map(|(s, n)| format!("{:6.2}", s / n.max(1) as f64))
            .join(" ")
    );
}
