// Turns and zooms a WebGL 2 canvas by mouse, fingers and keys, and calls draw when it is to be drawn again. Y is up; lift is how far
// from above it is seen at first (rad), near how large.
const domecastOrbit = (canvas, gl, draw, { lift = 0.35, near = 1 } = {}) => {
  let turn = 0.7, asked = false;
  const ask = () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => { asked = false; draw(); });
  };
  // Clears the canvas: the matrix that fits the box from low to high into it, the way to the eye, pixels for each of the page's.
  const frame = (low, high) => {
    const wide = canvas.clientWidth, tall = canvas.clientHeight, dense = Math.min(window.devicePixelRatio || 1, 2);
    canvas.width = Math.max(1, wide * dense); canvas.height = Math.max(1, tall * dense);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT); gl.enable(gl.DEPTH_TEST);
    const mid = low.map((v, k) => (v + high[k]) / 2);
    const size = Math.hypot(...low.map((v, k) => high[k] - v)) * 0.5 / near;
    const [ct, st, cl, sl] = [Math.cos(turn), Math.sin(turn), Math.cos(lift), Math.sin(lift)];
    const right = [ct, 0, -st], up = [-st * sl, cl, -ct * sl], eye = [st * cl, sl, ct * cl];
    const aspect = wide / tall, fx = aspect > 1 ? 1 / (size * aspect) : 1 / size, fy = aspect > 1 ? 1 / size : aspect / size;
    const line = (axis, f) => axis.map((a) => a * f), dot = (a) => a[0] * mid[0] + a[1] * mid[1] + a[2] * mid[2];
    const r = line(right, fx), t = line(up, fy), d = line(eye, -0.25 / size);
    const matrix = new Float32Array([r[0], t[0], d[0], 0, r[1], t[1], d[1], 0, r[2], t[2], d[2], 0, -dot(r), -dot(t), -dot(d), 1]);
    return { matrix, eye, dense };
  };
  // A program of these shaders.
  const program = (vertex, fragment) => {
    const made = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source); gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made); gl.useProgram(made);
    return made;
  };
  const tilt = (by) => { lift = Math.max(-1.5, Math.min(1.5, lift + by)); };
  const zoom = (by) => { near = Math.max(0.5, Math.min(8, near * by)); };
  // one finger turns, two fingers zoom
  const held = new Map();
  const apart = () => { const [a, b] = [...held.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
  canvas.addEventListener("pointerdown", (e) => { held.set(e.pointerId, [e.clientX, e.clientY]); canvas.setPointerCapture(e.pointerId); });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (e) => held.delete(e.pointerId));
  canvas.addEventListener("pointermove", (e) => {
    const before = held.get(e.pointerId);
    if (!before) return;
    const width = held.size === 2 ? apart() : 0;
    held.set(e.pointerId, [e.clientX, e.clientY]);
    if (width) zoom(apart() / width);
    else { turn -= (e.clientX - before[0]) * 0.01; tilt((e.clientY - before[1]) * 0.01); }
    ask();
  });
  canvas.addEventListener("keydown", (e) => {
    const move = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[e.key];
    if (move) { turn += move[0]; tilt(move[1]); }
    else if (e.key === "+" || e.key === "=") zoom(1.15);
    else if (e.key === "-") zoom(1 / 1.15);
    else return;
    e.preventDefault(); ask();
  });
  window.addEventListener("resize", ask);
  return { ask, frame, program };
};
