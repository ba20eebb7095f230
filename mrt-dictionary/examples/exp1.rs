use mrt_dictionary::{bounce::*, config::*, prior::*, progress::Progress, symmetry::*, transport::*};
use mrt_core::{matrix::*, svd::*};
use mrt_runtime::shape::SHAPES;
use mrt_core::radiometry::sphere_light_irradiance;
use glam::DVec3;
fn spectrum(f: &[Matrix<f64>]) -> [usize;3] { let mut s: Vec<f64> = f.iter().flat_map(|m| svd(m.view()).singular_values).collect(); s.sort_by(|a,b| b.total_cmp(a)); [0.8,0.9,0.95].map(|e| energy_rank(&s,e)) }
fn main() {
    let shape=&SHAPES[0]; let res=16;
    let t=std::time::Instant::now();
    let classes=texel_parity_classes(shape,res);
    let raw=std::fs::read("/work/shared/oracle/cube.f32").unwrap();
    let data: Vec<f64>=raw.chunks_exact(4).map(|c| f32::from_le_bytes(c.try_into().unwrap()) as f64).collect();
    let lights=[[0.5,0.5,0.5],[0.3,0.7,0.6],[0.18,0.22,0.8],[0.5,0.85,0.5]].map(DVec3::from_array);
    let n=1536;
    for rec in [Reconstruction::Constant, Reconstruction::Bilinear, Reconstruction::TexelMean] {
        let f=closed_cube_bounce(res,rec,&Progress::silent()).unwrap();
        let ff=fold_bounce(&f,&classes);
        println!("{rec:?} F {:?} {:.2}s",spectrum(&ff),t.elapsed().as_secs_f64());
        let pc=PriorConfig{lights_per_axis:6,light_radius:0.1,k_d:usize::MAX};
        let samples=direct_samples(shape,res,&pc);
        let prior=light_prior(&samples,&classes,pc.k_d);
        println!("L_d {:?}",[0.8,0.9,0.95].map(|e| energy_rank(&prior.singular_values,e)));
        let p64=light_prior(&samples,&classes,64);
        let m=block_transport(&ff,&p64.basis,&classes,64);
        println!("M {:?}  {:.2}s",[0.8,0.9,0.95].map(|e| energy_rank(&m.singular_values,e)),t.elapsed().as_secs_f64());
        let err=|bt: Option<&BlockTransport>| { let mut sum=0.0; for (l,&p) in lights.iter().enumerate() {
            let d: Vec<f64>=shape.texels(res).map(|(fa,pt)| sphere_light_irradiance(p-pt,-fa.outward(),1e-6)).collect();
            let r=&data[(l*7+1)*n..(l*7+2)*n];
            let dm=Matrix::from_column_major(n,1,d);
            let e = match bt { None => multiply(f.view(),dm.view()), Some(b)=>{ let c=multiply(b.coefficients_from_direct.view(),dm.view()); multiply(b.indirect_basis.view(),c.view())}};
            let (mut a,mut q)=(0.0,0.0); for i in 0..n { a+=(e.data()[i]-r[i]).powi(2); q+=r[i]*r[i]; } sum+=(a/q).sqrt()*100.0; } sum/4.0 };
        println!("dense {:.3}",err(None));
        for k in [32,48,64,96] { let b=block_transport(&ff,&prior.basis,&classes,k); 
            print!("k {k} ({}) plain {:.3}",b.indirect_basis.columns(),err(Some(&b)));
            for w in [0.1,0.2,0.5,1.0] { let e=enriched_prior(&prior,&b.indirect_basis,shape,&classes,&Enrichment{constant_weight:w,indirect_weight:w}); let b=block_transport(&ff,&e.basis,&classes,k); print!("  w{w}: {:.3}",err(Some(&b))); }
            println!(" {:.2}s",t.elapsed().as_secs_f64()); }
    }
}
