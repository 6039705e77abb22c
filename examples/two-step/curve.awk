# A scene that pulls one node up, from no force to twice f0, step by step.
BEGIN {
  print "object organ " organ ".ela store=" organ ".h5"
  if (command) print command
  print "emit shapes"
  for (k = 0; k <= 40; ++k) {
    print "force organ", node, 0, 0, k / 20 * f0
    print "step 0"
  }
}
