// Light and colour of the surface, worked out once for each node: where a processor has to do what a graphics card would,
// the same at each corner of each triangle takes several times as long.
const SUN = [-0.35, 0.55, 0.758], GLINT = [-0.206, 0.371, 0.906]; // where light comes from, as the viewer has it
const BARE = [184, 191, 199], LIP = [186, 62, 54], DARKEST = 0.44, LIGHTEST = 1.2;

// Colours (4 n) of nodes into `tints`: red, green and blue, and the light alone over the lightest.
// shades: 0 to 1 along the palette, three bytes a shade; below 0 for what has no colour, and OF_LIP for a lip of a cut
// rows: of the camera, which light comes along with
const OF_LIP = -2;
const fillTints = (tints, shades, normals, palette, rows) => {
  const along = (light) => [0, 1, 2].map((k) => rows[0][k] * light[0] + rows[1][k] * light[1] + rows[2][k] * light[2]);
  const [sx, sy, sz] = along(SUN), [gx, gy, gz] = along(GLINT), [vx, vy, vz] = rows[2], last = palette.length / 3 - 1;
  for (let n = 0, i = 0, t = 0; n < shades.length; n++, i += 3, t += 4) {
    const x = normals[i], y = normals[i + 1], z = normals[i + 2], shade = shades[n];
    const light = DARKEST + 0.5 * Math.max(sx * x + sy * y + sz * z, 0) + 0.14 * (vx * x + vy * y + vz * z);
    const glint = Math.max(gx * x + gy * y + gz * z, 0), eighth = (glint * glint * glint) ** 8;
    const from = shade === OF_LIP ? LIP : shade < 0 ? BARE : palette, at = shade < 0 ? 0 : 3 * Math.min(Math.round(shade * last), last);
    const gloss = 0.14 * 255 * eighth;
    tints[t] = from[at] * light + gloss;
    tints[t + 1] = from[at + 1] * light + gloss;
    tints[t + 2] = from[at + 2] * light + gloss;
    tints[t + 3] = (255 / LIGHTEST) * light;
  }
};
