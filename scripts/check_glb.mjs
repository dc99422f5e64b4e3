// Validates GLB files with the Khronos glTF validator (npm package gltf-validator).
//
//     node scripts/check_glb.mjs FOLDER_WITH_NODE_MODULES FILE.glb ...
//
// Errors and warnings fail; exit code 1 then.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { resolve } from "node:path";

const [modules, ...files] = process.argv.slice(2);
const validator = createRequire(resolve(modules, "package.json"))("gltf-validator");
let faults = 0;
for (const file of files) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(file)));
  const { numErrors, numWarnings, messages } = report.issues;
  faults += numErrors + numWarnings;
  console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings`);
  for (const m of messages) console.log(`  ${m.severity} ${m.code} ${m.pointer ?? ""}: ${m.message}`);
}
console.log(faults ? `${faults} faults` : "all GLB files are valid");
process.exit(faults ? 1 : 0);
