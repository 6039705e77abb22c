#!/bin/bash
# A grey picture of 8 x 8 squares, PGM.
awk 'BEGIN { print "P2 64 64 255"; for (y = 0; y < 64; ++y) for (x = 0; x < 64; ++x) print (int(x / 8) + int(y / 8)) % 2 ? 230 : 40 }'
