#!/bin/bash
# A cube of 8 mm and a square sheet of 24 mm, 0.3 mm thick, through it, as two parts of an OBJ file.
box() { # X0 X1 Z0 Z1
  printf 'o box\n'
  printf 'v %s\n' "$1 $1 $3" "$2 $1 $3" "$2 $2 $3" "$1 $2 $3" "$1 $1 $4" "$2 $1 $4" "$2 $2 $4" "$1 $2 $4"
  printf 'f %s\n' '-8 -5 -6' '-8 -6 -7' '-4 -3 -2' '-4 -2 -1' '-8 -7 -3' '-8 -3 -4' '-7 -6 -2' '-7 -2 -3' '-6 -5 -1' '-6 -1 -2' '-5 -8 -4' '-5 -4 -1'
}
box 0 8 0 8
box -8 16 3.6 3.9
