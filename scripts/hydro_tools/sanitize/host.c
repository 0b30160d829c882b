// A host of the plugin without Python, for sanitizers: threads load models, step, copy, reset and free them.
//
//   host LIBRARY THREADS ROUNDS MODEL.xml...
//
// Exits with 1 where a model is refused, a number is not finite, or a run is not that of the first thread, bit for bit.

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <mujoco/mujoco.h>

enum { STEPS = 20, MOST_MODELS = 16 };

static char **paths;
static int models, rounds;
static mjtNum *expected[MOST_MODELS];
static int sizes[MOST_MODELS];

static void silent(const char *text) { (void)text; }

// Qpos and qvel after a run, in `state`; what a model leaves of memory is freed.
static int run(const char *path, mjtNum *state, int *size) {
  char error[1000] = "";
  mjModel *model = mj_loadXML(path, NULL, error, sizeof error);
  if (!model) {
    fprintf(stderr, "host: %s: %s\n", path, error);
    return 1;
  }
  mjData *data = mj_makeData(model);
  for (int pass = 0; pass < 2; pass++) {
    mj_resetData(model, data);
    for (int i = 0; i < model->nv; i++) data->qvel[i] = 0.1 * (i % 3);
    for (int i = 0; i < STEPS; i++) mj_step(model, data);
  }
  mjData *copy = mj_copyData(NULL, model, data);
  mj_deleteData(data);
  mj_step(model, copy);
  *size = model->nq + model->nv;
  if (state) {
    memcpy(state, copy->qpos, sizeof(mjtNum) * model->nq);
    memcpy(state + model->nq, copy->qvel, sizeof(mjtNum) * model->nv);
  }
  mj_deleteData(copy);
  mj_deleteModel(model);
  return 0;
}

static void *work(void *argument) {
  long broken = 0, first = (long)argument;
  for (int round = 0; round < rounds; round++) {
    int at = (int)((first + round) % models), size;
    mjtNum *state = malloc(sizeof(mjtNum) * sizes[at]);
    if (run(paths[at], state, &size) || memcmp(state, expected[at], sizeof(mjtNum) * sizes[at])) {
      fprintf(stderr, "host: %s: another run than the first\n", paths[at]);
      broken++;
    }
    free(state);
  }
  return (void *)broken;
}

int main(int count, char **words) {
  if (count < 5 || count - 4 > MOST_MODELS) {
    fprintf(stderr, "usage: host LIBRARY THREADS ROUNDS MODEL.xml... (at most %d models)\n", MOST_MODELS);
    return 2;
  }
  int threads = atoi(words[2]);
  rounds = atoi(words[3]);
  paths = words + 4;
  models = count - 4;
  mju_user_warning = silent;
  mj_loadPluginLibrary(words[1]);
  for (int i = 0; i < models; i++) {
    if (run(paths[i], NULL, &sizes[i])) return 1;
    expected[i] = malloc(sizeof(mjtNum) * sizes[i]);
    if (run(paths[i], expected[i], &sizes[i])) return 1;
    for (int k = 0; k < sizes[i]; k++) {
      if (!isfinite(expected[i][k])) {
        fprintf(stderr, "host: %s: a number that is not finite\n", paths[i]);
        return 1;
      }
    }
  }
  pthread_t *each = malloc(sizeof(pthread_t) * threads);
  long broken = 0;
  for (long i = 0; i < threads; i++) pthread_create(&each[i], NULL, work, (void *)i);
  for (int i = 0; i < threads; i++) {
    void *found;
    pthread_join(each[i], &found);
    broken += (long)found;
  }
  free(each);
  for (int i = 0; i < models; i++) free(expected[i]);
  printf("host: %d models, %d threads, %d rounds, %ld broken\n", models, threads, rounds, broken);
  return broken > 0;
}
