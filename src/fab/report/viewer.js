// Shows the assembly (a GLB that stands in the page, gzipped) and pulls it apart. Where the browser cannot, the pictures stay.
(async () => {
  "use strict";
  const box = document.getElementById("viewer");
  if (!box) return;
  const canvas = box.querySelector("canvas"), slider = box.querySelector("input[type=range]");
  const still = box.querySelector("[data-still]"), hide = box.querySelector("fieldset");
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true });
  const stills = still.querySelectorAll("img");
  const showStill = () => stills.forEach((img, i) => { img.hidden = (slider.value > 50 ? 1 : 0) !== i; });
  const lacks = !gl ? "WebGL 2" : typeof DecompressionStream === "undefined" ? "DecompressionStream" : "";
  if (lacks) {
    canvas.hidden = true; hide.hidden = true; box.dataset.state = "pictures";
    const note = document.createElement("p");
    note.className = "soft";
    note.textContent = `This browser has no ${lacks}, so the assembly cannot be turned here: two pictures stand in its place. parts/assembly.glb opens in any 3D viewer.`;
    box.prepend(note);
    slider.addEventListener("input", showStill); showStill();
    return;
  }
  still.hidden = true;

  const packed = Uint8Array.from(atob(document.getElementById("assembly").textContent.trim()), (c) => c.charCodeAt(0));
  const unpacked = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const raw = new Uint8Array(await new Response(unpacked).arrayBuffer());
  const view = new DataView(raw.buffer), textSize = view.getUint32(12, true);
  const gltf = JSON.parse(new TextDecoder().decode(raw.subarray(20, 20 + textSize)));
  const binary = 20 + textSize + 8;
  const read = (accessor, Kind, width) => {
    const a = gltf.accessors[accessor], v = gltf.bufferViews[a.bufferView];
    return new Kind(raw.buffer.slice(binary + (v.byteOffset || 0), binary + (v.byteOffset || 0) + a.count * width * Kind.BYTES_PER_ELEMENT));
  };
  const shifts = gltf.scenes.map((scene) => {
    const found = {};
    const walk = (index) => {
      const node = gltf.nodes[index];
      if (node.mesh !== undefined) found[node.mesh] = node.translation || [0, 0, 0];
      (node.children || []).forEach(walk);
    };
    scene.nodes.forEach(walk);
    return found;
  });

  const orbit = domecastOrbit(canvas, gl, () => draw()), ask = orbit.ask;
  const program = orbit.program(`#version 300 es
    in vec3 p; uniform mat4 m; uniform vec3 shift; uniform float size; out vec3 q;
    void main() { q = p + shift; gl_Position = m * vec4(q, 1.0); gl_PointSize = size; }`, `#version 300 es
    precision highp float; in vec3 q; uniform vec4 color; uniform vec3 eye; uniform float cut, plain; out vec4 o;
    void main() { if (cut > 0.5 && q.z > 0.0) discard;
      if (plain > 0.5) { o = color; return; }
      vec3 n = normalize(cross(dFdx(q), dFdy(q)));
      float l = 0.35 + 0.5 * abs(dot(n, normalize(eye))) + 0.15 * max(0.0, n.y);
      o = vec4(pow(color.rgb, vec3(1.0 / 2.2)) * l, color.a); }`);
  const at = (name) => gl.getUniformLocation(program, name);
  const u = { m: at("m"), shift: at("shift"), color: at("color"), eye: at("eye"), cut: at("cut"), plain: at("plain"), size: at("size") };

  // what the closed and the exploded assembly fill
  const room = shifts.map(() => ({ low: [1e9, 1e9, 1e9], high: [-1e9, -1e9, -1e9] }));
  let dome = 0;
  const families = new Map();
  const items = gltf.meshes.map((mesh, index) => {
    const part = mesh.primitives[0], box3 = gltf.accessors[part.attributes.POSITION];
    for (let k = 0; k < 3; k++) {
      shifts.forEach((s, i) => {
        const { low, high } = room[i];
        low[k] = Math.min(low[k], box3.min[k] + s[index][k]); high[k] = Math.max(high[k], box3.max[k] + s[index][k]);
      });
    }
    const vertices = gl.createVertexArray(); gl.bindVertexArray(vertices);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, read(part.attributes.POSITION, Float32Array, 3), gl.STATIC_DRAW);
    const place = gl.getAttribLocation(program, "p");
    gl.enableVertexAttribArray(place); gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, read(part.indices, Uint32Array, 1), gl.STATIC_DRAW);
    const family = mesh.name.replace(/[\s\d]+$/, "").replace(/^(upper|lower) (magnet).*/, "$2").replace(/_/g, " ");
    if (!families.has(family)) families.set(family, true);
    if (family === "dome") dome = index;
    return { vertices, count: gltf.accessors[part.indices].count, family, index,
      color: gltf.materials[part.material].pbrMetallicRoughness.baseColorFactor };
  });
  // dots move with the dome; rays, field of view and loads belong to the closed sensor
  const colors = { dots: [0.05, 0.05, 0.05, 1], rays: [0.82, 0.29, 0.25, 1], "field of view": [0.1, 0.5, 0.8, 1], loads: [0.1, 0.6, 0.3, 1] };
  const layers = Object.entries(JSON.parse(document.getElementById("overlay").textContent)).map(([name, found]) => {
    const points = name === "dots" ? found : found.flatMap((line) => line.slice(1).flatMap((end, k) => [line[k], end]));
    const vertices = gl.createVertexArray(); gl.bindVertexArray(vertices);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(points.flatMap(([x, y, z]) => [x * 1e-3, z * 1e-3, -y * 1e-3])), gl.STATIC_DRAW);
    const place = gl.getAttribLocation(program, "p");
    gl.enableVertexAttribArray(place); gl.vertexAttribPointer(place, 3, gl.FLOAT, false, 0, 0);
    return { name, vertices, count: points.length, shown: name === "dots", kind: name === "dots" ? gl.POINTS : gl.LINES };
  });
  let isCut = false;
  const choice = (name, checked, change) => {
    const label = document.createElement("label"), tick = document.createElement("input");
    tick.type = "checkbox"; tick.checked = checked;
    tick.addEventListener("change", () => { change(tick.checked); ask(); });
    label.append(tick, " " + name); hide.append(label);
  };
  for (const family of families.keys()) choice(family, true, (on) => families.set(family, on));
  for (const layer of layers.filter((layer) => layer.count)) {
    choice(layer.name, layer.shown, (on) => { layer.shown = on; if (on && layer.name !== "dots") slider.value = 0; });
  }
  choice("cut in half", false, (on) => { isCut = on; });

  const draw = () => {
    const pull = slider.value / 100;
    const between = (name) => room[0][name].map((v, k) => v + pull * ((room[1] || room[0])[name][k] - v));
    const low = between("low"), high = between("high");
    const { matrix, eye, dense } = orbit.frame(low, high);
    gl.uniformMatrix4fv(u.m, false, matrix); gl.uniform3fv(u.eye, eye);
    const shown = items.filter((item) => families.get(item.family));
    gl.uniform1f(u.cut, isCut ? 1 : 0); gl.uniform1f(u.size, 5 * dense);
    for (const clear of [false, true]) {
      if (clear) {
        gl.uniform1f(u.plain, 1);
        for (const layer of layers.filter((one) => one.shown && (one.name === "dots" || pull === 0))) {
          const [a, b] = [shifts[0][dome], (shifts[1] || shifts[0])[dome]];
          gl.uniform3fv(u.shift, layer.name === "dots" ? a.map((v, k) => v + pull * (b[k] - v)) : [0, 0, 0]);
          gl.uniform4fv(u.color, colors[layer.name]); gl.bindVertexArray(layer.vertices);
          gl.drawArrays(layer.kind, 0, layer.count);
        }
      }
      gl.uniform1f(u.plain, 0);
      (clear ? gl.enable : gl.disable).call(gl, gl.BLEND);
      gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      gl.depthMask(!clear);
      for (const item of shown.filter((i) => (i.color[3] < 1) === clear)) {
        const [a, b] = [shifts[0][item.index], (shifts[1] || shifts[0])[item.index]];
        gl.uniform3fv(u.shift, a.map((v, k) => v + pull * (b[k] - v)));
        gl.uniform4fv(u.color, item.color);
        gl.bindVertexArray(item.vertices);
        gl.drawElements(gl.TRIANGLES, item.count, gl.UNSIGNED_INT, 0);
      }
    }
    gl.depthMask(true);
    box.dataset.state = "drawn " + Math.round(pull * 100);
  };
  slider.addEventListener("input", ask);
  ask();
})();
