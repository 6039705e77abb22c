# Pages and glTF files of emboss-render, as browsers and other programs read them.
# shellcheck shell=bash disable=SC2317 # functions are called by name

# A solid that a sphere presses, with stress from frame 1 on: in.h5.
pressed_cube() {
  exp2ela -q --solid --cell 5 --fix 'z<1' "$GEWEBE_ROOT/tests/golden/in/cube.ply" -o in.ela
  cp "$GEWEBE_ROOT/tests/golden/in/scenes/emboss-render-page.scene" in.scene
  ffe-run -q in.scene -o in.h5
}

# Opens the page FILE with the script in standard input, which runs once the viewer is ready and returns lines: browse FILE.
browse() {
  {
    cat "$1"
    printf '<script>viewer.ready.then(async (ms) => {\n'
    cat
    cat <<'END'
}).then((lines) => lines.join("\n"), (error) => `error ${error.message}`).then((text) => {
  const result = document.createElement("pre"); result.id = "result"; result.textContent = text; document.body.replaceChildren(result); });</script>
END
  } >browsed.html
  # Its socket needs a short path.
  TMPDIR=/tmp timeout 100 chromium --headless --no-sandbox --enable-unsafe-swiftshader --use-angle=swiftshader --window-size=800,600 --user-data-dir="$PWD/browser" \
      --host-resolver-rules='MAP * ~NOTFOUND' --virtual-time-budget=20000 --dump-dom "file://$PWD/browsed.html" 2>browser.log >dom.html || fail 'chromium failed' "$(tail -20 browser.log)" >&2
  sed -n '/<pre id="result">/,/<\/pre>/p' dom.html | sed 's/.*<pre id="result">//; s/<\/pre>.*//'
  rm -r browser
}

test_pages_load_nothing() {
  pressed_cube
  emboss-render in.h5 -o out.html
  ! grep -qE '(src|href)=|https?://|fetch\(|XMLHttpRequest|WebSocket|import\(' out.html || fail 'the page refers to something else'
  [[ $(grep -c '<script' out.html) == $(grep -c '</script>' out.html) ]] || fail 'elements do not end'
  # A name that looks like markup stays text.
  cp in.h5 'in<!--<script>"&.h5'
  emboss-render 'in<!--<script>"&.h5' -o out2.html
  [[ $(grep -o '<script' out2.html | wc -l) == $(grep -o '<script' out.html | wc -l) ]] || fail 'a file name begins an element'
  ! grep -q '<!--' out2.html || fail 'a file name begins a comment'
}

test_pages_react() {
  command -v chromium >/dev/null || skip 'no chromium'
  pressed_cube
  emboss-render in.h5 --field displacement -o out.html
  browse out.html >result <<'END'
    const shot = () => { viewer.draw(); return canvas.toDataURL(); };
    const set = (id, value, event) => { $(id).value = value; $(id).dispatchEvent(new Event(event)); };
    const drag = (type, x, y) => canvas.dispatchEvent(new PointerEvent(type, {pointerId: 1, clientX: x, clientY: y, buttons: 1, bubbles: true}));
    const lines = [`message [${$('message').textContent}] frames ${viewer.scene.times.length}`];
    const last = shot();
    let before = last;
    const changed = (what) => { const now = shot(); lines.push(`${what} ${now === before ? 'same' : 'changed'}`); before = now; };
    changed('nothing');
    set('time', 0, 'input'); changed('slider');
    set('time', 5, 'input'); changed('slider-back');
    lines.push(`as-before ${before === last}`);
    drag('pointerdown', 200, 200); drag('pointermove', 260, 230); drag('pointerup', 260, 230); changed('orbit');
    canvas.dispatchEvent(new WheelEvent('wheel', {deltaY: -100})); changed('zoom');
    set('field', 1, 'change'); changed('stress');
    set('field', -1, 'change'); changed('material');
    set('light', 'endoscope', 'change'); changed('endoscope');
    set('light', 'camera', 'change'); changed('camera');
    set('clip', 'x', 'change'); changed('clip');
    set('clip-at', 0.3, 'input'); changed('clip-at');
    set('clip', '', 'change'); changed('no-clip');
    document.querySelector('#parts input').click(); changed('hidden');
    [...document.querySelectorAll('#views button')].find((b) => b.textContent === 'iso').click();
    for (let n = 0; n < 5; ++n) canvas.dispatchEvent(new WheelEvent('wheel', {deltaY: 100}));
    viewer.draw();
    const overlay = () => $('overlay').toDataURL(), arrows = overlay();
    $('arrows').click(); viewer.draw(); lines.push(`arrows ${overlay() === arrows ? 'same' : 'changed'}`);
    const plot = () => $('plot').toDataURL(), curve = plot();
    set('curve', 1, 'change'); lines.push(`curve ${plot() === curve ? 'same' : 'changed'}`);
    // A browser without a window gives frames when it likes: here each comes 16 ms after it was asked for.
    window.requestAnimationFrame = (next) => setTimeout(() => next(performance.now()), 16);
    set('time', 0, 'input'); $('play').click();
    for (let n = 0; n < 100 && viewer.state.playing; ++n) await new Promise((done) => setTimeout(done, 50));
    lines.push(`played to ${viewer.state.frame}`);
    return lines;
END
  local what
  grep -qx 'message \[\] frames 6' result || fail 'the page does not begin' "$(<result)"
  grep -qx 'nothing same' result || fail 'pictures differ by themselves' "$(<result)"
  grep -qx 'as-before true' result || fail 'the slider does not come back' "$(<result)"
  for what in slider orbit zoom stress material endoscope camera clip clip-at no-clip hidden arrows curve; do
    grep -qx "$what changed" result || fail "$what changes nothing" "$(<result)"
  done
  grep -qx 'played to 5' result || fail 'play does not reach the end' "$(<result)"
}

# Points, stress and forces in the browser are those of the file.
test_pages_have_the_numbers_of_the_result() {
  command -v chromium >/dev/null || skip 'no chromium'
  python3 -c 'import h5py' 2>/dev/null || skip 'no h5py for python3'
  pressed_cube
  emboss-render in.h5 -o out.html
  browse out.html >result <<'END'
    const part = parts.find((p) => p.name === 'cube'), field = viewer.scene.fields[1];
    const lines = [`step ${part.step}`, `points ${part.points}`, `range ${field.low} ${field.high}`];
    for (let frame = 0; frame < part.frames; ++frame)
      for (let i = 0; i < part.points; ++i) {
        const place = [0, 1, 2].map((axis) => part.origin[axis] + part.step * part.rows[frame][3 * i + axis]);
        const stored = part.stored[frame][i];
        const stress = stored === 65535 ? 'none' : field.low + (field.high - field.low) * stored / 65534;
        lines.push(`${frame} ${i} ${place.join(' ')} ${stress}`);
      }
    viewer.scene.instruments[0].force.forEach((force, frame) => lines.push(`force ${frame} ${(force || [0, 0, 0]).join(' ')}`));
    return lines;
END
  python3 - <<'END'
import h5py
lines = [line.split() for line in open('result')]
step, points, low, high = float(lines[0][1]), int(lines[1][1]), float(lines[2][1]), float(lines[2][2])
seen = forces = stresses = 0
with h5py.File('in.h5') as f:
    o, probe, skin = f['objects/cube'], f['instruments/probe'], f['objects/cube/skin']
    assert points == len(skin['points']), points
    first = int(o['fields'].attrs['first_frame'])
    follow = lambda i, values: sum(w * values[n] for n, w in zip(skin['nodes'][i], skin['weights'][i]))
    def place_of(frame, i):
        return skin['points'][i] + follow(i, o['displacement'][frame])
    def stress_of(frame, i):
        values = o['fields/von_mises'][frame - first]
        own = [float(values[n]) for n in skin['nodes'][i]]
        return min(max(own), max(min(own), float(follow(i, values))))
    for line in lines[3:]:
        if line[0] == 'force':
            frame = int(line[1])
            for a in range(3):
                row = frame - int(probe.attrs['first_frame'])
                expected = 1e-6 * probe['force'][row][a] if row >= 0 else 0
                assert abs(float(line[2 + a]) - expected) <= 1e-12, (line, expected)
            forces += any(float(x) != 0 for x in line[2:])
            continue
        frame, i = int(line[0]), int(line[1])
        place = place_of(frame, i)
        for a in range(3):
            assert abs(float(line[2 + a]) - place[a]) <= 0.51 * step, (line, place)
        if frame < first:
            assert line[5] == 'none', line
        else:
            assert abs(float(line[5]) - stress_of(frame, i)) <= 0.51 * (high - low) / 65534 + 1e-6 * high, (line, stress_of(frame, i))
            stresses += 1
        seen += 1
assert seen >= 6 * 4 and stresses > 0 and forces > 0, (seen, stresses, forces)
END
}

# The structure of a glTF file, by glTF 2.0 alone: check_glb FILE prints parts, frames and morph targets.
check_glb() {
  python3 - "$1" <<'END'
import json, math, struct, sys
data = open(sys.argv[1], 'rb').read()
magic, version, size = struct.unpack_from('<4sII', data)
assert magic == b'glTF' and version == 2 and size == len(data), (magic, version, size, len(data))
length, kind = struct.unpack_from('<I4s', data, 12)
assert kind == b'JSON' and length % 4 == 0
g = json.loads(data[20:20 + length])
at = 20 + length
binary = b''
if at < len(data):
    more, kind = struct.unpack_from('<I4s', data, at)
    assert kind == b'BIN\0' and more % 4 == 0 and at + 8 + more == len(data)
    binary = data[at + 8:]
    assert g['buffers'] == [{'byteLength': more}]
width = {'SCALAR': 1, 'VEC3': 3}
code = {5126: 'f', 5125: 'I'}
for view in g.get('bufferViews', []):
    assert view['byteOffset'] % 4 == 0 and view['byteLength'] > 0 and view['byteOffset'] + view['byteLength'] <= len(binary), view
def values(n):
    a = g['accessors'][n]
    view, each = g['bufferViews'][a['bufferView']], width[a['type']]
    offset = a.get('byteOffset', 0)
    assert a['count'] > 0 and offset + 4 * each * a['count'] <= view['byteLength'], a
    flat = struct.unpack_from('<%d%s' % (each * a['count'], code[a['componentType']]), binary, view['byteOffset'] + offset)
    rows = [flat[i:i + each] for i in range(0, len(flat), each)]
    assert all(math.isfinite(x) for x in flat)
    if 'min' in a:
        assert list(a['min']) == [min(c) for c in zip(*rows)] and list(a['max']) == [max(c) for c in zip(*rows)], a
    return rows
frames = 1
for mesh in g.get('meshes', []):
    for p in mesh['primitives']:
        points = values(p['attributes']['POSITION'])
        assert 'min' in g['accessors'][p['attributes']['POSITION']]
        corners = values(p['indices'])
        assert len(corners) % 3 == 0 and max(corners)[0] < len(points)
        assert all(abs(math.hypot(*n) - 1) < 1e-5 for n in values(p['attributes']['NORMAL']))
        if 'COLOR_0' in p['attributes']:
            assert all(0 <= x <= 1 for row in values(p['attributes']['COLOR_0']) for x in row)
        assert 0 <= p['material'] < len(g['materials'])
        for target in p.get('targets', []):
            assert set(target) == set(p['attributes']), target
            assert all(len(values(n)) == len(points) for n in target.values())
            assert 'min' in g['accessors'][target['POSITION']]
        assert len(p.get('targets', [])) == len(mesh.get('weights', [])), mesh
for animation in g.get('animations', []):
    for channel in animation['channels']:
        sampler = animation['samplers'][channel['sampler']]
        times, node = [t for t, in values(sampler['input'])], g['nodes'][channel['target']['node']]
        assert 'min' in g['accessors'][sampler['input']] and all(a < b for a, b in zip(times, times[1:])), times
        frames = max(frames, len(times))
        targets = len(g['meshes'][node['mesh']].get('weights', []))
        expected = len(times) * (targets if channel['target']['path'] == 'weights' else 1)
        assert len(values(sampler['output'])) == expected, channel
print(len(g.get('meshes', [])), frames, sum(len(m.get('weights', [])) for m in g.get('meshes', [])))
END
}

test_gltf_files_are_sound() {
  pressed_cube
  emboss-render in.h5 -o out.glb
  [[ $(check_glb out.glb) == '2 6 8' ]] || fail 'parts, frames and targets' "$(check_glb out.glb)"
  emboss-render in.h5 --field von-mises -o out.glb
  [[ $(check_glb out.glb) == '2 6 8' ]] || fail 'with a field' "$(check_glb out.glb)"
  grep -aq COLOR_0 out.glb || fail 'no colours'
  # That this can fail: a number beyond what is stated, a buffer that ends early.
  local broken
  for broken in 's/"byteLength":[0-9]*,"target"/"byteLength":9999999,"target"/' 's/"min":\[[^,]*,/"min":[-77.0,/'; do
    LC_ALL=C sed "$broken" out.glb >broken.glb
    python3 - <<'END'
import struct
data = bytearray(open('broken.glb', 'rb').read())
struct.pack_into('<I', data, 8, len(data))
struct.pack_into('<I', data, 12, data.index(b'BIN\0') - 24)
open('broken.glb', 'wb').write(data)
END
    ! check_glb broken.glb 2>/dev/null >&2 || fail "a file that $broken broke passes"
  done
  # A cut changes triangles: parts come and go.
  printf '%s\n' 'object cube in.ela method=ffe' 'force cube "z>9" 0 0 -20' step 'cut cube plane 5 5 8 0 0 1 along=faces' step >in.scene
  ffe-run -q in.scene -o in.h5
  emboss-render in.h5 -o out.glb
  [[ $(check_glb out.glb) == '4 3 1' ]] || fail 'parts of a cut object' "$(check_glb out.glb)"
  grep -aq '"path":"scale"' out.glb || fail 'a part does not come or go'
}

test_other_programs_read_our_gltf() {
  pressed_cube
  emboss-render in.h5 --field displacement -o out.glb
  if has_module pygltflib; then
    python3 - <<'END'
import pygltflib
g = pygltflib.GLTF2().load('out.glb')
assert len(g.meshes) == 2 and len(g.animations) == 1 and len(g.meshes[0].primitives[0].targets) == 5, g.meshes
END
  fi
  if has_module trimesh; then
    python3 - <<'END'
import trimesh
scene = trimesh.load('out.glb')
assert len(scene.geometry) == 2, scene.geometry
sizes = sorted(round(1000 * float(x), 2) for x in scene.geometry['cube'].extents * 0.001)
assert sizes == [10, 10, 10], sizes
END
  fi
  if has_module vtk; then
    python3 - <<'END'
import vtk
reader = vtk.vtkGLTFReader()
reader.SetFileName('out.glb'); reader.ApplyDeformationsToGeometryOn(); reader.UpdateInformation()
assert reader.GetNumberOfAnimations() == 1
def box(time):
    reader.EnableAnimation(0)
    key = vtk.vtkStreamingDemandDrivenPipeline.UPDATE_TIME_STEP()
    reader.GetOutputInformation(0).Set(key, time)
    reader.Modified()
    reader.Update()
    surface = vtk.vtkCompositeDataGeometryFilter(); surface.SetInputConnection(reader.GetOutputPort()); surface.Update()
    return surface.GetOutput().GetNumberOfPoints(), surface.GetOutput().GetBounds()
points, bounds = box(0)
assert points > 100 and abs(bounds[1] - bounds[0] - 0.01) < 1e-6, (points, bounds)
END
  fi
}

test_films_are_coded() {
  cube >in.off
  # Without ffmpeg the message has the command.
  mkdir path
  ln -s "$BUILD/emboss-render" path/emboss-render
  expect_failure 1 emboss-render env PATH="$PWD/path" emboss-render --backend cpu --size 32 in.off -o out.mp4
  ! env PATH="$PWD/path" emboss-render --backend cpu --size 32 in.off -o out.mp4 2>message || fail 'a film without ffmpeg'
  grep -q -- '--to rgb -o - | ffmpeg -f rawvideo -pix_fmt rgb24 -s 32x32 -r 25' message || fail 'the message does not show the command' "$(<message)"
  [[ ! -e out.mp4 ]] || fail 'a failure left a film'
  command -v ffprobe >/dev/null || skip 'no ffmpeg'
  local kind
  for kind in mp4 webm; do
    emboss-render --backend cpu --size 64x48 --turn 10 --fps 5 in.off -o out.$kind
    [[ $(ffprobe -v error -count_frames -show_entries stream=width,height,nb_read_frames,r_frame_rate -of csv=p=0 out.$kind) == 64,48,5/1,10* ]] ||
      fail "$kind" "$(ffprobe -v error -count_frames -show_entries stream=width,height,nb_read_frames,r_frame_rate -of csv=p=0 out.$kind)"
  done
  # An ffmpeg that fails is an error, and leaves the old film.
  echo old >out.mp4
  printf '#!/bin/sh\nread x\nexit 3\n' >path/ffmpeg
  chmod +x path/ffmpeg
  expect_failure 1 emboss-render env PATH="$PWD/path" emboss-render --backend cpu --size 64 --turn 3 in.off -o out.mp4
  [[ $(<out.mp4) == old ]] || fail 'a failure changed the film'
}
