"""The module gewebe and the programs that its wheel brings: run in a folder that may be written, by tests/contract/wheel.sh."""
import io
import itertools
import math
import os
import struct
import subprocess
import sys
import threading
import unittest
import warnings
from pathlib import Path

import numpy

import gewebe
from gewebe import programs

try:
    import h5py  # noqa: F401
except ImportError:
    h5py = None

needs_h5py = unittest.skipUnless(h5py, 'no h5py')


def ball():
    return gewebe.run('metaball2vol --voxel 1', 'mc-opt', input='0 0 0 20\n').mesh()


def sphere_model(path='ball.ela', more=()):
    gewebe.run(['exp2ela', '--primitive', 'sphere:24x16', '--size', '50', '--fix', 'z<-20', '--name', 'ball', *more, '-o', Path(path)])
    return path


def volume(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return float(numpy.einsum('ij,ij->', a, numpy.cross(b, c))) / 6


class Programs(unittest.TestCase):
    def test_a_pipe_gives_what_the_shell_gives(self):
        env = {**os.environ, 'PATH': os.path.dirname(gewebe.path_of('mc-opt')) + ':' + os.environ['PATH']}
        said = subprocess.run(['bash', '-c', "echo '0 0 0 20' | metaball2vol --voxel 1 | mc-opt --resample 2"],
                              env=env, capture_output=True, check=True)
        ours = gewebe.run('metaball2vol --voxel 1', ['mc-opt', '--resample', '2'], input='0 0 0 20\n')
        self.assertEqual(said.stdout, ours.output)
        self.assertGreater(len(ours.output), 1000)

    def test_programs_are_those_of_the_wheel(self):
        for name in ('gewebe', 'metaball2vol', 'voxelize', 'csg', 'mc-opt', 'exp2ela', 'ffe-precompute', 'ffe-run', 'emboss-render'):
            path = gewebe.path_of(name)
            if 'GEWEBE_TEST_WHEEL' in os.environ:
                self.assertEqual(os.path.dirname(path), os.path.join(sys.prefix, 'bin'))
            said = subprocess.run([path, '--version'], capture_output=True, text=True, check=True).stdout
            self.assertTrue(said.startswith(name + ' '), said)
        with self.assertRaisesRegex(gewebe.Error, 'no program nothing'):
            gewebe.path_of('nothing')

    def test_progress_goes_from_0_to_1(self):
        told = []
        gewebe.run('metaball2vol --voxel 0.25', 'mc-opt', input='0 0 0 40\n', progress=lambda *what: told.append(what))
        self.assertEqual({name for name, _ in told}, {'metaball2vol', 'mc-opt'})
        self.assertTrue(all(0 <= done <= 1 for _, done in told))
        self.assertGreater(len({done for _, done in told}), 1)

    def test_figures_without_an_end_are_neither_progress_nor_a_message(self):
        told = []
        said = b'\rffe-run 0.1 s  2 x real time  1 frame\x1b[K\r\x1b[Kffe-run: warning: a\n\rffe-run 0.2 s  2 x real time  2 frames\x1b[K'
        listener = programs._Listener(io.BytesIO(said), lambda *what: told.append(what))
        listener.join()
        self.assertEqual((listener.lines, told), (['ffe-run: warning: a'], []))

    def test_what_progress_raises_is_raised(self):
        def stop(name, done):
            raise KeyError('enough')
        with self.assertRaisesRegex(KeyError, 'enough'):
            gewebe.run('metaball2vol --voxel 0.25', input='0 0 0 40\n', progress=stop)

    def test_stats_of_each_program(self):
        outcome = gewebe.run('metaball2vol --voxel 1', 'mc-opt', input='0 0 0 20\n', stats=True)
        self.assertEqual([stats['tool'] for stats in outcome.stats], ['metaball2vol', 'mc-opt'])

    def test_the_first_failure_is_raised_with_its_status(self):
        with self.assertRaisesRegex(gewebe.Error, '^metaball2vol: -?:?.*1') as caught:
            gewebe.run('metaball2vol --voxel 1', 'mc-opt', input='0 0 zero 20\n')
        self.assertEqual(caught.exception.status, 1)
        with self.assertRaisesRegex(gewebe.Error, '^mc-opt: ') as caught:
            gewebe.run('metaball2vol --voxel 1', 'mc-opt --nonsense', input='0 0 0 20\n')
        self.assertEqual(caught.exception.status, 2)
        with self.assertRaises(ValueError):
            gewebe.run()

    def test_who_is_cut_off_has_not_failed(self):
        # mc-opt --help reads nothing, so that the program before it ends by SIGPIPE.
        particles = '\n'.join(f'{x} {y} {z} 1.5' for x, y, z in itertools.product(range(0, 90, 3), repeat=3))
        outcome = gewebe.run('metaball2vol --voxel 1', 'mc-opt --help', input=particles)
        self.assertIn(b'mc-opt', outcome.output)
        # Of several that fail the first one is named.
        with self.assertRaisesRegex(gewebe.Error, '^metaball2vol: .*nonsense'):
            gewebe.run('metaball2vol --nonsense', 'mc-opt --rubbish', input=particles)

    def test_much_input_and_much_output(self):
        particles = '\n'.join(f'{x} {y} {z} 1.5' for x, y, z in itertools.product(range(0, 150, 3), repeat=3))
        self.assertGreater(len(particles), 1 << 20)
        self.assertGreater(len(gewebe.run('metaball2vol --voxel 1', input=particles).output), 1 << 16)
        # One that does not read it.
        with self.assertRaises(gewebe.Error):
            gewebe.run('metaball2vol --voxel nothing', input=particles)

    def test_warnings_are_those_of_python(self):
        mesh = ball()
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter('always')
            gewebe.run('exp2ela --unit m', input=mesh)
        self.assertTrue(all(str(w.message).startswith('exp2ela: warning: ') for w in caught), caught)


class Files(unittest.TestCase):
    def test_a_mesh_is_a_view(self):
        data = gewebe.run('metaball2vol --voxel 1', 'mc-opt', input='0 0 0 20\n').output
        mesh = gewebe.read_ply(data)
        self.assertEqual(mesh.points.shape[1], 3)
        self.assertTrue(numpy.shares_memory(mesh.points, numpy.frombuffer(data, 'u1')))
        self.assertTrue(numpy.shares_memory(mesh.triangles, numpy.frombuffer(data, 'u1')))
        radius = numpy.linalg.norm(mesh.points, axis=1)
        self.assertLess(radius.max() / radius.min(), 1.01)
        self.assertAlmostEqual(volume(mesh.points, mesh.triangles) / (4 / 3 * math.pi * radius.mean() ** 3), 1, delta=0.01)
        # From a file, written again to the byte, and read by a program.
        Path('ball.ply').write_bytes(data)
        again = gewebe.read_ply('ball.ply')
        self.assertTrue((again.points == mesh.points).all() and (again.triangles == mesh.triangles).all())
        self.assertEqual(again.to_bytes(), data)
        self.assertIn(b'ela_expl 1', gewebe.run('exp2ela', input=again).output)

    def test_normals_and_tetrahedra(self):
        self.assertIsNone(ball().normals)
        mesh = gewebe.run('metaball2vol --voxel 1', 'mc-opt --normals', input='0 0 0 20\n').mesh()
        outward = (mesh.normals * mesh.points).sum(axis=1) / numpy.linalg.norm(mesh.points, axis=1)
        self.assertGreater(outward.min(), 0.9)
        solid = gewebe.run('metaball2vol --voxel 1', 'mc-opt --tets --cell 4', input='0 0 0 20\n').mesh()
        a, b, c, d = (solid.points[solid.tetrahedra[:, k]] for k in range(4))
        self.assertGreater(numpy.einsum('ij,ij->i', numpy.cross(b - a, c - a), d - a).min(), 0)

    def test_meshes_of_ones_own(self):
        points = numpy.array([(0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10)], float)
        triangles = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
        gewebe.write_ply('tetra.ply', points=points, triangles=triangles)
        mesh = gewebe.read_ply('tetra.ply')
        self.assertTrue((mesh.points == points).all() and (mesh.triangles == triangles).all())
        outcome = gewebe.run('voxelize --voxel 0.5 tetra.ply', 'mc-opt')
        self.assertAlmostEqual(volume(outcome.mesh().points, outcome.mesh().triangles), 1000 / 6, delta=12)
        with self.assertRaises(ValueError):
            gewebe.write_ply('bad.ply', points=points, triangles=[(0, 1, 4)])

    def test_big_endian_meshes(self):
        mesh = ball()
        data = mesh.to_bytes()
        head, _, _ = data.partition(b'end_header\n')
        rows = [array.astype(array.dtype.newbyteorder('>')).tobytes() for array in mesh.elements.values()]
        big = gewebe.read_ply(head.replace(b'little', b'big') + b'end_header\n' + b''.join(rows))
        self.assertEqual(big.points.dtype.byteorder, '>')
        self.assertTrue((big.points == mesh.points).all() and (big.triangles == mesh.triangles).all())
        # Ours are little-endian, whatever they came from.
        self.assertEqual(big.to_bytes(), data)

    def test_columns_that_stand_apart(self):
        corners = numpy.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)], '<i4')
        points = numpy.array([(0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10)], float)
        face = numpy.empty(4, [('vertex_index count', 'u1'), ('vertex_index', '<i4', (3,))])
        face['vertex_index count'], face['vertex_index'] = 3, corners
        fields = ([('x', '<f8'), ('quality', '<f4'), ('y', '<f8'), ('z', '<f8')],  # something between them
                  [('z', '<f8'), ('y', '<f8'), ('x', '<f8')],  # another order
                  [('x', '<f4'), ('y', '<i4'), ('z', '<f4')],  # different types
                  [('x', '<f4'), ('y', '<f8'), ('z', '<f4')],
                  [('x', '<f8'), ('y', '<f8'), ('quality', '<f8'), ('z', '<f8')])
        for kinds in fields:
            vertex = numpy.zeros(4, kinds)
            for k, axis in enumerate('xyz'):
                vertex[axis] = points[:, k]
            again = gewebe.read_ply(gewebe.Ply({'vertex': vertex, 'face': face}, ['a comment']).to_bytes())
            self.assertTrue((again.points == points).all(), kinds)
            self.assertTrue((again.triangles == corners).all(), kinds)
            self.assertIsNone(again.normals)
            self.assertEqual(again.comments, ['a comment'])

    def test_broken_meshes_are_refused(self):
        data = ball().to_bytes()
        for at in (0, 3, 60, len(data) // 2, len(data) - 1):
            with self.assertRaises(gewebe.Error, msg=at):
                gewebe.read_ply(data[:at])
        with self.assertRaisesRegex(gewebe.Error, 'expected a binary one'):
            gewebe.read_ply(b'ply\nformat ascii 1.0\nelement vertex 0\nend_header\n')
        with self.assertRaisesRegex(gewebe.Error, 'expected a count that fits'):
            gewebe.read_ply(data.replace(b'element vertex', b'element vertex 9999', 1).replace(b'9999 ', b'9999', 1))
        mixed = (b'ply\nformat binary_little_endian 1.0\nelement face 2\nproperty list uchar uchar vertex_indices\nend_header\n'
                 b'\3\0\0\0\4\0\0\0')
        with self.assertRaisesRegex(gewebe.Error, 'different lengths'):
            gewebe.read_ply(mixed)

    def test_a_model(self):
        model = gewebe.read_ela(sphere_model())
        self.assertEqual(model.name, 'ball')
        self.assertEqual(model.points.shape, (len(model.mass), 3))
        surface = numpy.arange(len(model.points)) <= model.triangles.max()
        held = model.fixed.all(axis=1)
        self.assertTrue((held[surface] == (model.points[surface, 2] < -20)).all())
        self.assertTrue(held[~surface].all() and (model.central[~surface] == -1).all())  # central nodes
        i, j = model.springs['i'], model.springs['j']
        length = numpy.linalg.norm(model.points[i] - model.points[j], axis=1)
        self.assertLess(abs(length - model.springs['rest']).max(), 1e-9)
        self.assertEqual(model.materials[0]['name'], 'generic')
        self.assertIsNone(model.tetrahedra)
        self.assertIsNone(model.space)
        in_lps = gewebe.read_ela(sphere_model('lps.ela', more=['--space', 'lps']))
        self.assertEqual(in_lps.space, 'LPS')
        self.assertTrue((in_lps.points == model.points).all())
        for text in (b'', b'ela_expl 1\n', b'ela_expl 2\nend\n', b'ela_expl 1\nname "a"\nnodes 3\n0 0 0 1 1 - -1 0\nend\n'):
            with self.assertRaises(gewebe.Error):
                gewebe.read_ela(text)

    def test_a_solid(self):
        gewebe.run('metaball2vol --voxel 1', 'mc-opt --tets --cell 5', 'exp2ela -o solid.ela', input='0 0 0 20\n')
        model = gewebe.read_ela('solid.ela')
        self.assertEqual(model.tetrahedra.shape, (len(model.tetrahedron_material), model.tetrahedra.shape[1]))
        self.assertIn(model.tetrahedra.shape[1], (4, 10))
        self.assertLess(model.tetrahedra.max(), len(model.points))
        self.assertGreater(model.materials[0]['poisson'], 0)

    def test_all_sections_of_a_model(self):
        text = '''ela_expl 1
        name "two words"   # a comment
        materials 2
        0 "soft gel" 1e-3 5000 1 0.2 0.45
        1 stone 2e-3 20000 1 0.1 0.3
        nodes 5
        0 0 0 1 0.5 xyz -1 0
        1 0 0 2 0.25 x -1 1
        0 1 0 3 0.125 - 4 0
        0 0 1 4 0 yz -1 1
        9 8 7 5 1 - -1 0

        springs 2
        0 1 e 100 2 1
        2 4 c 50 1 1.5
        triangles 2
        0 2 1
        0 1 3
        texcoords 2
        0 0 0 1 1 0
        .5 .25 .125 1 1 1
        normals 5
        0 0 1
        0 1 0
        1 0 0
        0 0 1
        0 0 0
        tetrahedra 1
        0 1 2 3 1
        skin 1
        .25 .25 .25 0
        end
        '''
        model = gewebe.read_ela(text.encode())
        self.assertEqual(model.name, 'two words')
        self.assertEqual(model.materials, [
            {'name': 'soft gel', 'density': 1e-3, 'young': 5000, 'thickness': 1, 'damping_ratio': 0.2, 'poisson': 0.45},
            {'name': 'stone', 'density': 2e-3, 'young': 20000, 'thickness': 1, 'damping_ratio': 0.1, 'poisson': 0.3}])
        self.assertEqual(model.points.tolist(), [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [9, 8, 7]])
        self.assertEqual(model.mass.tolist(), [1, 2, 3, 4, 5])
        self.assertEqual(model.drag.tolist(), [0.5, 0.25, 0.125, 0, 1])
        self.assertEqual(model.fixed.tolist(), [[True] * 3, [True, False, False], [False] * 3, [False, True, True], [False] * 3])
        self.assertEqual(model.central.tolist(), [-1, -1, 4, -1, -1])
        self.assertEqual(model.node_material.tolist(), [0, 1, 0, 1, 0])
        self.assertEqual(model.springs.tolist(), [(0, 1, b'e', 100, 2, 1), (2, 4, b'c', 50, 1, 1.5)])
        self.assertEqual(model.triangles.tolist(), [[0, 2, 1], [0, 1, 3]])
        self.assertEqual(model.texcoords[1].tolist(), [.5, .25, .125, 1, 1, 1])
        self.assertEqual(model.normals[2].tolist(), [1, 0, 0])
        self.assertEqual(model.tetrahedra.tolist(), [[0, 1, 2, 3]])
        self.assertEqual(model.tetrahedron_material.tolist(), [1])
        self.assertEqual(model.skin.tolist(), [[.25, .25, .25, 0]])
        self.assertIsNone(model.skin_triangles)
        with self.assertRaisesRegex(gewebe.Error, 'no section'):
            gewebe.read_ela(text.replace('springs', 'strings').encode())
        with self.assertRaisesRegex(gewebe.Error, 'ends within its'):
            gewebe.read_ela(text.replace('skin 1', 'skin 9').encode())

    @needs_h5py
    def test_a_store_answers_as_the_run_does(self):
        sphere_model()
        model = gewebe.read_ela('ball.ela')
        tip = int(model.points[:, 2].argmax())
        gewebe.run(f'ffe-precompute --columns {tip} ball.ela -o ball.h5')
        with gewebe.Store('ball.h5') as store:
            self.assertEqual(list(store), ['ball'])
            self.assertEqual(store['ball'].nodes().tolist(), [tip])
            u = store['ball'].displacement({tip: (100, 0, 300)})
            with self.assertRaisesRegex(gewebe.Error, 'has no column'):
                store['ball'].displacement({tip: (1, 0, 0), 0: (1, 0, 0)})
            p, i, x, axis = store['ball'].matrix
            self.assertEqual(len(i), p[-1])
        Path('pull.scene').write_text(f'object ball ball.ela store=ball.h5\nforce ball {tip} 100 0 300\nstep\n')
        gewebe.run('ffe-run pull.scene -o run.h5')
        with gewebe.Results('run.h5') as results:
            self.assertEqual(list(results), ['ball'])
            moved = results['ball']
            self.assertLess(abs(moved.displacement() - u).max(), 1e-5 * abs(u).max())
            self.assertTrue((moved.shape(0) == model.points).all())
            self.assertGreater(moved.shape()[tip, 2], model.points[tip, 2])
            with self.assertRaises(IndexError):
                moved.displacement(len(results.time))
        for kind in (gewebe.Store, gewebe.Results):
            with self.assertRaises(gewebe.Error):
                kind('run.h5' if kind is gewebe.Store else 'ball.h5')

    @needs_h5py
    def test_results_of_what_was_cut(self):
        sphere_model('cut.ela', ['--bend', '--centrals', '0'])
        Path('cut.scene').write_text('object ball cut.ela method=ela\ntimestep 0.01\nstep\ncut ball plane 0 0 5 0 0 1\nstep\nstep\n')
        gewebe.run('ffe-run -q cut.scene -o cut.h5')
        with gewebe.Results('cut.h5') as results:
            names = list(results)
            self.assertGreater(len(names), 1)
            whole = results['ball']
            for name in names:
                for frame in range(results[name].first, len(results.time)):
                    shape, triangles = results[name].shape(frame), results[name].triangles(frame)
                    self.assertLess(triangles.max(), len(shape))
            part = results[names[1]]
            self.assertEqual(part.first, 2)
            with self.assertRaises(IndexError):
                part.shape(1)
            self.assertNotEqual(len(whole.shape(1)), len(whole.shape(2)))

    @needs_h5py
    def test_cuts_follow_each_other_by_number(self):
        with h5py.File('cuts.h5', 'w') as file:
            file.attrs['format'] = 'gewebe_results'
            file['time'] = numpy.arange(14) / 10
            for order, name in enumerate(('z', 'a')):
                body = file.create_group(f'objects/{name}')
                body.attrs['order'] = order
                body.attrs['first_frame'] = order
                for cut in (None, *range(1, 12)) if name == 'z' else (None,):
                    part = body if cut is None else body.create_group(f'cuts/{cut}')
                    if cut is not None:
                        part.attrs['first_frame'] = cut + 1
                    # Each cut gives one node more.
                    nodes = 3 + (cut or 0)
                    part['points'] = numpy.zeros((nodes, 3))
                    part['displacement'] = numpy.full((14 if cut is None else 13 - cut, nodes, 3), float(cut or 0))
                    part['triangles'] = numpy.zeros((1, 3), int)
        with gewebe.Results('cuts.h5') as results:
            self.assertEqual(list(results), ['z', 'a'])
            self.assertEqual(len(results), 2)
            z, a = results['z'], results['a']
            for frame in range(14):
                cut = min(max(frame - 1, 0), 11)
                self.assertEqual(z.points(frame).shape, (3 + cut, 3), frame)
                self.assertTrue((z.shape(frame) == cut).all(), frame)
            self.assertTrue((z.shape() == 11).all() and (z.displacement(-12) == 1).all())
            self.assertIsNone(z.tetrahedra())
            with self.assertRaisesRegex(IndexError, 'frame -14 of an object that is there from 1 to 13'):
                a.points(-14)

    @needs_h5py
    def test_stress_of_a_solid(self):
        gewebe.run('metaball2vol --voxel 1', 'mc-opt --tets --cell 6', ['exp2ela', '--fix', 'z<-5', '--name', 's', '-o', 's.ela'],
                   input='0 0 0 20\n')
        Path('s.scene').write_text("object s s.ela\nstep\nemit stress s\nforce s z>5 0 0 100\nstep\n")
        gewebe.run('ffe-run s.scene -o s.h5')
        with gewebe.Results('s.h5') as results:
            s = results['s']
            self.assertIsNone(s.field('stress', 1))
            self.assertEqual(s.field('stress').shape, (len(s.points()), 6))
            self.assertGreater(s.field('von_mises').max(), 0)
            self.assertEqual(s.field('element_stress').shape, (len(s.tetrahedra()), 6))
            self.assertIsNone(s.field('nothing'))


class Driving(unittest.TestCase):
    def test_a_scene_of_ones_own(self):
        sphere_model()
        model = gewebe.read_ela('ball.ela')
        tip = int(model.points[:, 2].argmax())
        with gewebe.drive('-o', 'driven.ply') as scene:
            self.assertEqual(scene.time, 0)
            self.assertEqual(scene.shapes(), {})
            scene.ask('object ball ball.ela', f'displace ball {tip} 0 0 3', 'emit shapes', 'step 0.1')
            shape = scene.shapes()['ball']
            self.assertTrue(numpy.allclose(shape[tip], model.points[tip] + (0, 0, 3), atol=1e-9))
            with self.assertRaisesRegex(gewebe.Error, 'error 5: .*nowhere'):
                scene.ask('force nowhere 0 0 0 1')
            # All lines behind one that is refused are carried out; the first one is named.
            with self.assertRaisesRegex(gewebe.Error, '^error 6: '):
                scene.ask('nonsense', 'force nowhere 0 0 0 1', 'step 0.1')
            with self.assertRaisesRegex(gewebe.Error, '^error 10: '):
                scene.ask('sync', 'nonsense')
            self.assertEqual(scene.ask(), [])
            said = scene.ask('sync', 'nodes ball', 'sync')
            self.assertEqual([words[0] for words in said], ['sync', 'nodes', 'sync'])
            self.assertAlmostEqual(float(said[0][1]), 0.2)
            with self.assertRaises(ValueError):
                scene.ask('step\nstep')
            folder = scene.folder.name
        self.assertFalse(os.path.exists(folder))
        mesh = gewebe.read_ply('driven.ply')
        self.assertTrue(numpy.allclose(mesh.points[tip], shape[tip]))

    def test_steps_are_answered_by_arrays(self):
        sphere_model()
        with gewebe.Scene() as scene:
            self.assertIsNone(scene._repr_png_())
            with self.assertRaisesRegex(gewebe.Error, 'no answer to draw'):
                scene.picture()
            scene.add('ball', 'ball.ela', method='ffe')
            for what in ('forces', 'shapes', 'instruments'):
                scene.tell('emit', what)
            scene.tell('instrument', 'p q'.replace(' ', '_'), 'sphere', 8, numpy.array([0, 0, 80.5]))
            scene.tell('displace', 'ball', 'near:0,0,50,5', [0, 0, 1.5])
            answer = scene.step(0.25)
            said = scene.ask('step 0.25')
            self.assertEqual((answer.step, answer.time), (1, 0.25))
            node, *force = next(said[k + 1] for k, words in enumerate(said) if words[0] == 'forces')
            self.assertEqual(answer.forces['ball'].nodes[0], int(node))
            self.assertTrue((answer.forces['ball'].vectors[0] == numpy.array(force, float)).all())
            self.assertGreater(answer.forces['ball'].total[2], 1000)
            self.assertTrue((answer.shapes['ball'] == scene.shapes()['ball']).all())
            self.assertEqual(answer.instruments['p_q'].position[2], 80.5)
            self.assertIsNone(answer.instruments['p_q'].hand)
            self.assertEqual([round(a.time, 3) for a in scene.run(1, 0.25)], [0.75, 1])
            picture = scene._repr_png_()
            self.assertEqual(picture[:8], b'\x89PNG\r\n\x1a\n')
            self.assertEqual(struct.unpack('>2I', scene.picture('80x60')[16:24]), (80, 60))
            with self.assertRaisesRegex(gewebe.Error, "no object 'bal', expected one of ball"):
                scene.tell('force', 'bal', 'z>4', 0, 0, 1)
        with self.assertRaisesRegex(gewebe.Error, 'the scene is closed'):
            scene.step()

    def test_stress_estimates_and_cuts_are_read(self):
        sphere_model(more=['--solid', '--cell', '12', '-q'])
        with gewebe.drive('--estimate') as scene:
            scene.add('ball', 'ball.ela', method='ffe')
            scene.tell('emit', 'stress', 'ball', 'z>40')
            scene.tell('displace', 'ball', 'near:0,0,50,9', 0, 0, 1)
            answer = scene.step(0.1)
            self.assertGreater(answer.stress['ball'].von_mises.max(), 0)
            self.assertEqual(answer.stress['ball'].tensors.shape, (len(answer.stress['ball'].nodes), 6))
            self.assertTrue(0 < answer.estimates['ball'].relative < 2)
        sphere_model()
        with gewebe.Scene() as scene:
            scene.add('ball', 'ball.ela', method='ffe')
            scene.step(0.1)
            scene.tell('cut', 'ball', 'springs', 'z>45')
            self.assertEqual(scene.step(0.1).events[0][:2], ['cut', 'ball'])
            with self.assertRaisesRegex(gewebe.Error, 'surface of ball is unknown'):
                scene.picture()

    def test_lines_are_made_of_words(self):
        self.assertEqual(gewebe.scene_line('force', 'o', numpy.array([0.1, 2]), 3, 1e-20, Path('a b.ela')), 'force o 0.1 2.0 3 1e-20 "a b.ela"')
        for wrong in (math.nan, True, 'a\nb', 'a"b'):
            with self.assertRaises(ValueError):
                gewebe.scene_line('step', wrong)
        with self.assertRaisesRegex(gewebe.Error, 'no answer to a step'):
            gewebe.read_answers([['sync', '0']])

    def test_a_run_that_can_not_begin(self):
        with self.assertRaisesRegex(gewebe.Error, 'nonsense') as caught:
            gewebe.drive('--nonsense')
        self.assertEqual(caught.exception.status, 2)

    def test_two_scenes_at_once(self):
        sphere_model()
        times = []

        def run(steps):
            with gewebe.drive() as scene:
                scene.ask('object ball ball.ela', *['step 0.1'] * steps)
                times.append(round(float(scene.ask('sync')[0][1]), 6))

        threads = [threading.Thread(target=run, args=(steps,)) for steps in (3, 7)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(sorted(times), [0.3, 0.7])

    def test_a_frame_that_is_overwritten_is_read_anew(self):
        def frame(value):
            name, data = b'ball', numpy.full(3, value)
            head = struct.pack('<8Q', 0, 0, 0, 0, 1, 0, 0, 0) + struct.pack('<4Q', 96, len(name), 104, 1)
            return head + name.ljust(8, b'\0') + data.tobytes()

        size = len(frame(0.0))
        with open('shapes', 'wb') as file:  # frame 4 is there, and frame 6 has begun in its place
            file.write(b'GWBSHAPE' + struct.pack('<7Q', 1, 6, 4, 64, size, 64 + size, size) + frame(6.0) + frame(5.0))
        shapes = gewebe.Shapes('shapes')
        seen = []
        reader = threading.Thread(target=lambda: seen.append(shapes.last()), daemon=True)
        reader.start()
        reader.join(0.2)
        self.assertEqual(seen, [])
        with open('shapes', 'r+b') as file:
            file.seek(24)
            file.write(struct.pack('<Q', 5))
        reader.join(60)
        self.assertEqual(seen[0]['ball'].tolist(), [[5, 5, 5]])
        # A frame that has begun in the other place is no harm.
        with open('shapes', 'r+b') as file:
            file.seek(16)
            file.write(struct.pack('<2Q', 7, 6))
        self.assertEqual(shapes.last()['ball'].tolist(), [[6, 6, 6]])
        # Of a file that grows the new part is seen.
        with open('shapes', 'r+b') as file:
            file.seek(0, os.SEEK_END)
            file.write(frame(7.0))
            file.seek(16)
            file.write(struct.pack('<6Q', 7, 7, 64, size, 64 + 2 * size, size))
        self.assertEqual(shapes.last()['ball'].tolist(), [[7, 7, 7]])
        shapes.close()
        with open('no.shapes', 'wb') as file:
            file.write(b'GWBSHAPE' + struct.pack('<7Q', 2, 0, 0, 0, 0, 0, 0))
        with self.assertRaisesRegex(gewebe.Error, 'another version'):
            gewebe.Shapes('no.shapes')

    def test_an_exception_ends_the_run(self):
        with self.assertRaises(ZeroDivisionError):
            with gewebe.drive() as scene:
                process = scene.process
                1 / 0
        self.assertIsNotNone(process.returncode)


if __name__ == '__main__':
    unittest.main(verbosity=2)
