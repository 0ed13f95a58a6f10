/* Stands between the program and the system: disks that are slow, fail or are full, clocks that jump, threads that are stuck.
 * What is wrong stands in the file SHIM_CONTROL, which may change at any time, or in SHIM_ variables. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* SYNC_MS: milliseconds that each fsync takes. SYNC_FAILS: fsyncs in ten that fail. CLOCK: the time of day jumps by a day,
 * to and fro. FULL: no file grows beyond this number of bytes. STUCK_MS: milliseconds for which a thread that gets SIGUSR1 is stuck.
 * READ_ONLY: no file is opened to be written. */
enum { SYNC_MS, SYNC_FAILS, CLOCK, FULL, STUCK_MS, READ_ONLY, WRONGS };
static const char *const names[WRONGS] = {
    "SHIM_SYNC_MS", "SHIM_SYNC_FAILS", "SHIM_CLOCK", "SHIM_FULL", "SHIM_STUCK_MS", "SHIM_READ_ONLY",
};
static int fixed[WRONGS];
static volatile int *wrong = fixed;

static void pass(long milliseconds) {
    struct timespec left = { milliseconds / 1000, milliseconds % 1000 * 1000000 };
    while (nanosleep(&left, &left) == -1 && errno == EINTR) { }
}

static void stick(int signal) { (void)signal; int kept = errno; pass(wrong[STUCK_MS]); errno = kept; }

__attribute__((constructor)) static void begin(void) {
    for (int i = 0; i < WRONGS; i++) { const char *text = getenv(names[i]); fixed[i] = text ? atoi(text) : 0; }
    const char *control = getenv("SHIM_CONTROL");
    int file = control ? open(control, O_RDONLY) : -1;
    void *map = file < 0 ? MAP_FAILED : mmap(0, sizeof fixed, PROT_READ, MAP_SHARED, file, 0);
    if (map != MAP_FAILED) wrong = map;
    struct sigaction action = { .sa_handler = stick, .sa_flags = SA_RESTART };
    sigaction(SIGUSR1, &action, 0);
}

int fsync(int file) {
    static int calls;
    static int (*real)(int);
    if (!real) real = (int (*)(int))dlsym(RTLD_NEXT, "fsync");
    pass(wrong[SYNC_MS]);
    if (__sync_fetch_and_add(&calls, 1) * 7 % 10 < wrong[SYNC_FAILS]) { errno = EIO; return -1; }
    return real(file);
}

ssize_t write(int file, const void *bytes, size_t count) {
    static ssize_t (*real)(int, const void *, size_t);
    struct stat status;
    if (!real) real = (ssize_t (*)(int, const void *, size_t))dlsym(RTLD_NEXT, "write");
    if (wrong[FULL] && fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_size + (off_t)count > wrong[FULL]) { errno = ENOSPC; return -1; }
    return real(file, bytes, count);
}

int open64(const char *path, int flags, ...) {
    static int (*real)(const char *, int, ...);
    va_list rest;
    va_start(rest, flags);
    mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    if (!real) real = (int (*)(const char *, int, ...))dlsym(RTLD_NEXT, "open64");
    if (wrong[READ_ONLY] && (flags & O_ACCMODE) != O_RDONLY && strncmp(path, "/dev/", 5)) { errno = EROFS; return -1; }
    return real(path, flags, mode);
}

int clock_gettime(clockid_t clock, struct timespec *now) {
    static int calls;
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    int done = real(clock, now);
    if (clock == CLOCK_REALTIME && wrong[CLOCK] && __sync_fetch_and_add(&calls, 1) % 2) now->tv_sec -= 86400;
    return done;
}
