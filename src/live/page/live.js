"use strict";
const $ = (id) => document.getElementById(id);
const COLORS = ["#ff6b6b", "#6fcf70", "#7db8ff"];
const SPAN_S = 10;
let samples = [];

function arrow(to, from, at) {
  const [dx, dy] = [at[0] - from[0], at[1] - from[1]];
  const length = Math.hypot(dx, dy);
  to.beginPath();
  to.moveTo(...from);
  to.lineTo(...at);
  if (length > 4) {
    const [ux, uy] = [dx / length * 4, dy / length * 4];
    to.moveTo(at[0] - ux - uy, at[1] - uy + ux);
    to.lineTo(...at);
    to.lineTo(at[0] - ux + uy, at[1] - uy - ux);
  }
  to.stroke();
}

function ring(to, at, radius) {
  to.beginPath();
  to.arc(at[0], at[1], radius, 0, 2 * Math.PI);
  to.stroke();
}

function overlay(to, reading) {
  const magnify = Number($("magnify").value) || 1;
  to.lineWidth = 1.5;
  for (const [from, now] of reading.dots) {
    to.strokeStyle = now ? "#ffdc00" : "#e61e1e";
    if (now) arrow(to, from, [0, 1].map((i) => from[i] + magnify * (now[i] - from[i])));
    else ring(to, from, 4);
  }
  to.strokeStyle = "#ff3cff";
  for (const [from, end] of reading.tractions) arrow(to, from, end);
  to.strokeStyle = "#28c850";
  for (const at of reading.markers) ring(to, at, 8);
  if (reading.camera_force_n && reading.size) {
    const middle = reading.size.map((v) => v / 2);
    to.strokeStyle = "#ff0000";
    to.lineWidth = 4;
    arrow(to, middle, [0, 1].map((i) => middle[i] + 25 * reading.camera_force_n[i]));
  }
}

async function picture(url) {
  const image = new Image();
  image.src = url;
  await image.decode();
  return image;
}

async function draw(canvas, reading, layers, then) {
  const images = await Promise.all(layers.filter(Boolean).map(picture));
  if (reading.size && canvas.width !== reading.size[0]) [canvas.width, canvas.height] = reading.size;
  const to = canvas.getContext("2d");
  to.clearRect(0, 0, canvas.width, canvas.height);
  for (const image of images) to.drawImage(image, 0, 0, canvas.width, canvas.height);
  then(to);
}

function curves(canvas, first) {
  const to = canvas.getContext("2d");
  const [w, h] = [canvas.width, canvas.height];
  to.clearRect(0, 0, w, h);
  if (!samples.length) return;
  const end = samples[samples.length - 1][0];
  let most = 1e-3;
  for (const [, v] of samples) if (v) for (let k = 0; k < 3; k++) most = Math.max(most, Math.abs(v[first + k]));
  most *= 1.1;
  const y = (v) => h / 2 - v / most * h / 2;
  to.strokeStyle = "#555";
  to.lineWidth = 1;
  to.beginPath();
  to.moveTo(0, h / 2);
  to.lineTo(w, h / 2);
  to.stroke();
  to.fillStyle = "#bbb";
  to.font = "12px sans-serif";
  to.fillText("±" + most.toPrecision(2), 4, 14);
  for (let k = 0; k < 3; k++) {
    to.strokeStyle = COLORS[k];
    to.lineWidth = 1.5;
    to.beginPath();
    let open = false;
    for (const [time, v] of samples) {
      const x = w * (1 - (end - time) / SPAN_S);
      if (v && open) to.lineTo(x, y(v[first + k]));
      else if (v) to.moveTo(x, y(v[first + k]));
      open = Boolean(v);
    }
    to.stroke();
  }
}

function text(values, sds, places) {
  if (!values) return "not measured";
  return values.map((v, k) => v.toFixed(places) + (sds ? " ± " + sds[k].toFixed(places) : "")).join(", ");
}

async function show(reading) {
  const isGood = reading.status === "ok" && reading.device === "ok";
  const what = reading.device === "ok" ? reading.problems : [reading.device, ...reading.problems];
  $("status").textContent = what.length ? what.join(", ").replaceAll("_", " ") : "ok";
  $("status").className = isGood ? "" : "bad";
  $("numbers").textContent = `frame ${reading.frame}, ${reading.rate_hz.toFixed(1)} frames/s, age ${reading.age_ms.toFixed(2)} ms, ` +
    `${reading.dots_ok} of ${reading.dots.length} dots, ${reading.markers.length} markers, ${reading.dropped} dropped` +
    (reading.hardness ? `; hardness: ${reading.hardness}` : "");
  await draw($("view"), reading, [reading.image], (to) => overlay(to, reading));
  $("skin-figure").hidden = !reading.skin;
  if (reading.skin) {
    $("skin-range").textContent = reading.skin_range_mm;
    await draw($("skin"), reading, [reading.image, reading.skin], (to) => {
      if (!reading.outline) return;
      to.strokeStyle = "#fff";
      to.lineWidth = 2;
      to.beginPath();
      reading.outline.forEach((at) => to.lineTo(...at));
      to.closePath();
      to.stroke();
    });
  }
  samples.push(...reading.samples);
  const end = samples.length ? samples[samples.length - 1][0] : 0;
  samples = samples.filter(([time]) => time > end - SPAN_S && time <= end);
  curves($("force"), 0);
  curves($("torque"), 3);
  $("force-now").textContent = text(reading.wrench?.slice(0, 3), reading.wrench_sd?.slice(0, 3), 3);
  $("torque-now").textContent = text(reading.wrench?.slice(3), reading.wrench_sd?.slice(3), 2);
  document.body.dataset.frame = reading.frame;
}

let newest = null;
let isBusy = false;
async function next() {
  if (isBusy) return;
  isBusy = true;
  while (newest) {
    const reading = newest;
    newest = null;
    try {
      await show(reading);
    } catch (error) {
      console.error(error);
    }
  }
  isBusy = false;
}

const events = new EventSource("events");
events.onmessage = (event) => {
  const reading = JSON.parse(event.data);
  if (newest) reading.samples.unshift(...newest.samples);
  newest = reading;
  next();
};
events.onerror = () => {
  $("status").textContent = "domecast does not answer: it has ended, or is not there yet";
  $("status").className = "bad";
};
