use domecast::{design, parts};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let d = match design::load(std::path::Path::new(&a[1])) {
        Ok(d) => d,
        Err(e) => {
            eprintln!("{e}");
            std::process::exit(1)
        }
    };
    let t = std::time::Instant::now();
    let m = parts::Measures::of(&d).unwrap_or_else(|e| panic!("{e}"));
    println!("measures {:?} {:?}", t.elapsed(), m.view);
    let t = std::time::Instant::now();
    match parts::build_measured(&m, &[domecast::layout::Hit::new(0.0, 0.0)]) {
        Ok(ps) => {
            let mut rows = vec![];
            let t = std::time::Instant::now();
            let asm = parts::Assembly::of(&m, &ps).unwrap();
            println!("assembly {:?} {:?}", t.elapsed(), asm.items.len());
            let items: Vec<_> = asm.items.iter().map(|i| domecast::mesh::GlbItem{name:&i.name,color:i.color,mesh:&i.mesh}).collect();
            let mut f = std::fs::File::create(format!("{}/assembly.glb", a[2])).unwrap();
            domecast::mesh::write_glb(&items, &[domecast::mesh::GlbScene{name:"closed".into(),shift_mm:vec![]},domecast::mesh::GlbScene{name:"exploded".into(),shift_mm:asm.items.iter().map(|i|i.explode_mm).collect()}], &mut f).unwrap();
            let t = std::time::Instant::now();
            match parts::check_assembly(&m, &ps, &asm) {
                Ok(()) => println!("checks ok"),
                Err(e) => println!("CHECK {e}"),
            }
            println!("checks {:?}", t.elapsed());
            println!("built in {:?}", t.elapsed());
            for p in ps {
                println!(
                    "{} V={:.3} genus={} tris={} {:?}",
                    p.name,
                    p.volume_mm3,
                    p.genus,
                    p.mesh.triangles.len(),
                    p.bounds
                );
                let mut f = std::fs::File::create(format!("{}/{}.stl", a[2], p.name)).unwrap();
                p.write_stl(&mut f).unwrap();
                let exact = domecast::mesh::Brep::exact(&p.construction);
                println!("  step {} exact {}", p.name, exact.is_some());
                let brep = exact.unwrap_or_else(|| domecast::mesh::Brep::faceted(&p.mesh));
                std::fs::write(format!("{}/{}.step", a[2], p.name), brep.to_step(&p.name)).unwrap();
                let mut f = std::fs::File::create(format!("{}/{}.3mf", a[2], p.name)).unwrap();
                domecast::mesh::write_3mf(&[(&p.name, &p.mesh)], &mut f).unwrap();
                rows.push(serde_json::json!({"name": p.name, "file": format!("{}.stl", p.name), "volume_mm3": p.volume_mm3, "genus": p.genus, "bbox_mm": [p.bounds.min_mm.to_array(), p.bounds.max_mm.to_array()]}));
            }
            std::fs::write(format!("{}/manifest.json", a[2]), serde_json::json!({"parts": rows}).to_string())
                .unwrap();
        }
        Err(e) => println!("ERROR {e}"),
    }
}
