/* Drives ffe-run by its socket, reads shapes in shared memory: drive SOCKET SHAPES, see README.md.
 */
#define _DEFAULT_SOURCE
#include <fcntl.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#define WALL "\"y>6 and z>34 and z<46\""

static void fail(const char* what, const char* why) {
  fprintf(stderr, "drive: %s: %s\n", what, why);
  exit(1);
}

/* ---- A client of ffe-run --serve --ack --listen: gewebe_serve(5) ---- */

struct scene {
  FILE *answers, *lines; /* from it, to it */
  double time;           /* when it was greeted, s */
  unsigned long number;  /* of lines that were sent */
  char* said;            /* what the last ones were answered */
  size_t length, room;
};

static int connected(const char* path) {
  struct sockaddr_un address = {.sun_family = AF_UNIX};
  const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
  if (fd < 0 || strlen(path) >= sizeof address.sun_path)
    fail(path, "no socket");
  strcpy(address.sun_path, path);
  if (connect(fd, (struct sockaddr*)&address, sizeof address) == 0)
    return fd;
  close(fd);
  return -1;
}

static void close_scene(struct scene* s) {
  fclose(s->answers);
  fclose(s->lines);
  free(s->said);
}

static struct scene open_scene(const char* path) {
  struct scene s = {0};
  for (int turn = 0; turn < 200; ++turn, usleep(50000)) { /* it may not listen yet */
    char greeting[256];
    const int fd = connected(path);
    if (fd < 0)
      continue;
    s.answers = fdopen(fd, "r");
    s.lines = fdopen(dup(fd), "w");
    if (s.answers == NULL || s.lines == NULL)
      fail(path, "no file descriptor is left");
    if (fgets(greeting, sizeof greeting, s.answers) && sscanf(greeting, "ready %lf", &s.time) == 1)
      return s;
    close_scene(&s); /* busy: the client before is on its way out */
  }
  fail(path, "nobody lets me in");
  return s;
}

static void keep(struct scene* s, const char* line, size_t length) {
  if (s->length + length + 1 > s->room) {
    s->room = 2 * (s->length + length + 1);
    s->said = realloc(s->said, s->room);
    if (s->said == NULL)
      fail("answers", "no memory is left");
  }
  memcpy(s->said + s->length, line, length + 1);
  s->length += length;
}

/* Sends all lines at once, then collects what they are answered until the last one is done. */
static const char* ask(struct scene* s, const char* lines) {
  char* line = NULL;
  size_t room = 0;
  ssize_t length;
  for (const char* c = lines; *c; ++c)
    s->number += *c == '\n';
  fputs(lines, s->lines);
  fflush(s->lines);
  s->length = 0;
  keep(s, "", 0);
  while ((length = getline(&line, &room, s->answers)) > 0) {
    unsigned long number;
    if (strncmp(line, "error ", 6) == 0)
      fail("the scene", line);
    if (sscanf(line, "ok %lu", &number) != 1)
      keep(s, line, (size_t)length);
    else if (number == s->number)
      break;
  }
  free(line);
  if (length <= 0)
    fail("the scene", "the connection ended");
  return s->said;
}

static const char* next_line(const char* line) {
  const char* end = strchr(line, '\n');
  return end ? end + 1 : line + strlen(line);
}

/* ---- The file of --shapes-in ---- */

struct shapes {
  int file;
  const uint64_t* words; /* mapped */
  size_t bytes;
  uint64_t* frame; /* a copy of the last one */
};

static uint64_t load(const struct shapes* s, size_t word) {
  return __atomic_load_n(&s->words[word], __ATOMIC_ACQUIRE);
}

static void map(struct shapes* s) {
  struct stat info;
  if (s->words != NULL)
    munmap((void*)s->words, s->bytes);
  if (fstat(s->file, &info) != 0)
    fail("shapes", "cannot be looked at");
  s->bytes = (size_t)info.st_size;
  s->words = mmap(NULL, s->bytes, PROT_READ, MAP_SHARED, s->file, 0);
  if (s->words == MAP_FAILED)
    fail("shapes", "cannot be mapped");
}

static struct shapes open_shapes(const char* path) {
  struct shapes s = {.file = open(path, O_RDONLY)};
  if (s.file < 0)
    fail(path, "cannot open");
  map(&s);
  if (memcmp(s.words, "GWBSHAPE", 8) != 0 || s.words[1] != 1)
    fail(path, "no shapes, or of another version");
  return s;
}

/* Copies the last frame. */
static void read_shapes(struct shapes* s) {
  while (1) {
    const uint64_t sequence = load(s, 3), place = 4 + sequence % 2 * 2;
    const uint64_t start = load(s, place), size = load(s, place + 1);
    if (start + size > s->bytes) { /* the file has grown */
      map(s);
      continue;
    }
    s->frame = realloc(s->frame, size + 8);
    if (s->frame == NULL)
      fail("shapes", "no memory is left");
    memcpy(s->frame, s->words + start / 8, size);
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if (load(s, 2) < sequence + 2) /* else it was overwritten meanwhile */
      return;
  }
}

struct shape {
  const char* name;
  int name_bytes;
  size_t nodes;
  const double* places; /* x, y, z of each */
};

static size_t object_count(const struct shapes* s) {
  return s->frame[4];
}

static struct shape shape_of(const struct shapes* s, size_t object) {
  const uint64_t* entry = s->frame + 8 + 4 * object;
  return (struct shape){(const char*)s->frame + entry[0], (int)entry[1], entry[3],
                        (const double*)(s->frame + entry[2] / 8)};
}

/* ---- Figures ---- */

/* On the tool, in N. */
static double force(struct scene* s) {
  for (const char* line = ask(s, "instruments\n"); *line; line = next_line(line)) {
    double x, y, z;
    if (sscanf(line, "tool %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %lf %lf %lf", &x, &y,
               &z) == 3)
      return sqrt(x * x + y * y + z * z) / 1e6;
  }
  fail("the scene", "no tool");
  return 0;
}

/* How far nodes are from where they rest, their mean in mm. */
static double moved(const double* rest, const double* places, size_t nodes) {
  double total = 0;
  for (size_t k = 0; k < 3 * nodes; k += 3) {
    const double x = places[k] - rest[k], y = places[k + 1] - rest[k + 1],
                 z = places[k + 2] - rest[k + 2];
    total += sqrt(x * x + y * y + z * z);
  }
  return total / (double)nodes;
}

/* The numbers of the lines behind the first. */
static double* rest_of(const char* answer, size_t nodes) {
  double* rest = malloc((3 * nodes + 1) * sizeof *rest);
  char* at = (char*)next_line(answer);
  if (rest == NULL)
    fail("nodes", "no memory is left");
  for (size_t k = 0; k < 3 * nodes; ++k)
    rest[k] = strtod(at, &at);
  return rest;
}

static void print_reach(struct shape shape) {
  double low = INFINITY, high = -INFINITY;
  for (size_t k = 0; k < shape.nodes; ++k) {
    low = fmin(low, shape.places[3 * k + 1]);
    high = fmax(high, shape.places[3 * k + 1]);
  }
  printf("%.*s reaches from %.3f to %.3f mm.\n", shape.name_bytes, shape.name, low, high);
}

/* ---- What it does ---- */

static void grasp(struct scene* s, struct shapes* shapes) {
  size_t nodes = 0, grasped = 0;
  ask(s, "object vessel vessel.ela\ngravity 0 -9810 0\ninstrument tool sphere 3 0 14 40\n");
  sscanf(ask(s, "nodes vessel rest\n"), "nodes vessel %zu", &nodes);
  double* rest = rest_of(s->said, nodes);
  sscanf(ask(s, "select vessel " WALL "\n"), "select vessel %zu", &grasped);
  printf("The vessel has %zu nodes, the tool grasps %zu of them.\n", nodes, grasped);
  ask(s, "grasp vessel " WALL " tool\nmove tool 0 19 40 over 0.5\nrun 1 every 0.02\n");
  printf("Pulled by 5 mm it pulls back by %.4f N,\n", force(s));
  read_shapes(shapes);
  if (shape_of(shapes, 0).nodes != nodes)
    fail("shapes", "another number of nodes");
  printf("its nodes have moved by %.4f mm.\n", moved(rest, shape_of(shapes, 0).places, nodes));
  free(rest);
}

static void cut(struct scene* s) {
  const char* line = ask(s, "cut vessel plane 0 0 28 0 0 1\ncut vessel plane 0 0 52 0 0 1\n"
                            "step 0.02\n");
  for (; *line; line = next_line(line)) {
    size_t nodes;
    char name[128];
    if (sscanf(line, "cut vessel springs %*s doubled %zu", &nodes) == 1)
      printf("A cut opens it at %zu nodes,\n", nodes);
    if (sscanf(line, "part vessel %127s nodes %zu", name, &nodes) == 2)
      printf("%s comes off with %zu nodes.\n", name, nodes);
  }
}

static void carry(struct scene* s, struct shapes* shapes) {
  double now = 0;
  size_t objects = 0;
  printf("At %.2f s I am back,\n", s->time);
  ask(s, "move tool 0 34 40 over 0.5\n");
  for (int k = 0; k < 150; ++k)
    ask(s, "step 0.02\n");
  sscanf(ask(s, "sync\n"), "sync %lf", &now);
  sscanf(ask(s, "objects\n"), "objects %zu", &objects);
  printf("at %.2f s there are %zu objects.\n", now, objects);
  printf("The tool carries %.4f N,\n", force(s));
  read_shapes(shapes);
  for (size_t k = 0; k < object_count(shapes); ++k)
    print_reach(shape_of(shapes, k));
  ask(s, "end\n");
}

int main(int argc, char** argv) {
  if (argc != 3)
    fail("wrong use", "expected drive SOCKET SHAPES");
  struct scene scene = open_scene(argv[1]);
  struct shapes shapes = open_shapes(argv[2]);
  grasp(&scene, &shapes);
  cut(&scene);
  close_scene(&scene); /* the scene stays as it is */
  scene = open_scene(argv[1]);
  carry(&scene, &shapes);
  close_scene(&scene);
  free(shapes.frame);
  return 0;
}
