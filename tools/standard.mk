# From what you have of an organ to its surface, a solid, a run and a film. `gewebe --makefile` printed this file; change what you like.
#
#   make                                  a ball that stands for the organ
#   make INPUT=scan.nii.gz LABEL=5        a label volume: NIfTI, NRRD, MetaImage, Inrimage
#   make INPUT=liver.stl                  a closed mesh, particles (.particles), a volume (.vdb)
#   make film                             run.mp4 as well; needs ffmpeg
#   make clean                            removes what was made
#
# What there is already is made again where its input or an option changed. `make -n` prints the commands; each has a man page.

INPUT ?= organ.particles
# Voxels of this label, in a label volume.
LABEL ?= 1
# Lengths are in mm: edges of voxels and of the largest tetrahedra.
VOXEL ?= 2
CELL ?= 10
# `exp2ela --list-materials` prints what there is.
MATERIAL ?= liver
# The lowest part of the height that is held.
HELD ?= 0.2
# A ball of this radius presses the organ from above, so deep, in so many steps.
RADIUS ?= 10
DEPTH ?= 5
STEPS ?= 20
# Of the film, in pixels.
SIZE ?= 640x480

SHELL := bash
.SHELLFLAGS := -eo pipefail -c
.DELETE_ON_ERROR:

all: organ.ply force.svg run.html
film: all run.mp4

# Stands for an organ: a line per particle, x y z and the diameter.
organ.particles:
	echo 0 0 0 60 > $@

# Changes where an option does, so that all that depends on it is made again.
organ.options: FORCE
	@echo '$(INPUT) $(LABEL) $(VOXEL) $(CELL) $(MATERIAL) $(HELD) $(RADIUS) $(DEPTH) $(STEPS) $(SIZE)' > $@.new; \
	  cmp -s $@.new $@ && rm $@.new || mv $@.new $@

# The organ as a volume, by the kind of what there is.
organ.vdb: $(INPUT) organ.options
	case '$<' in \
	  *.vdb) cp '$<' $@ ;; \
	  *.particles) metaball2vol --voxel $(VOXEL) '$<' -o $@ ;; \
	  *.nii | *.nii.gz | *.nrrd | *.nhdr | *.mha | *.mhd | *.inr) voxelize --label $(LABEL) --voxel $(VOXEL) '$<' -o $@ ;; \
	  *) voxelize --voxel $(VOXEL) '$<' -o $@ ;; \
	esac

# Its surface, for other programs.
organ.ply: organ.vdb
	mc-opt --components largest $< -o $@

# Its largest part as tetrahedra with their material, and the scene, which needs to know where the organ is.
organ.ela: organ.vdb
	mc-opt --tets --cell $(CELL) --components largest $< | exp2ela --material $(MATERIAL) -o organ.free.ela
	read -r held x y z < <(awk -v held=$(HELD) ' \
	  $$1 == "nodes" { n = $$2; next } \
	  n-- > 0 { if (low == "" || $$3 < low) low = $$3; if (high == "" || $$3 > high) { x = $$1; y = $$2; high = $$3 } } \
	  END { print low + held * (high - low), x, y, high }' organ.free.ela); \
	  exp2ela --fix "z<=$$held" organ.free.ela -o $@; \
	  awk -v x=$$x -v y=$$y -v z=$$z -v r=$(RADIUS) -v d=$(DEPTH) -v n=$(STEPS) 'BEGIN { \
	    print "object organ organ.ela method=ffe"; \
	    print "instrument ball sphere", r, x, y, z + r + 0.1; \
	    print "move ball", x, y, z + r - d, "over 1"; \
	    print "run 1 every", 1 / n }' > press.scene
	rm organ.free.ela

# Shapes over time, and forces in 1e-6 N with depths in mm. --estimate says what the mesh costs: smaller cells cost time.
run.h5: organ.ela
	ffe-run -q --estimate press.scene -o $@
run.csv: organ.ela
	ffe-run -q --estimate press.scene -o $@

force.svg: run.csv
	gewebe plot --x ball.depth --y ball.force $< -o $@
run.html: run.h5
	emboss-render --field displacement $< -o $@
run.mp4: run.h5
	emboss-render --field displacement --frames all --size $(SIZE) $< -o $@

clean:
	rm -f organ.vdb organ.ply organ.ela organ.options press.scene run.h5 run.csv force.svg run.html run.mp4

FORCE:
.PHONY: all film clean FORCE
