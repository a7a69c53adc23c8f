/* Fails one chosen system call of a program, loaded into it with LD_PRELOAD: see scripts/failures.
 *
 * Calls on files whose path holds FAIL_BELOW are counted. The call of number FAIL_AT fails as FAIL_HOW says: a number of
 * errno, "short" (half of the bytes are written), "kill" (the program dies before it) or "torn" (it dies after half of the
 * bytes). FAIL_FROM instead of FAIL_AT fails all calls from that number on. FAIL_COUNT names a file to which the number of
 * calls is written at the end. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

enum outcome { PASS, FAIL, SHORT, TORN };

static atomic_long calls;

__attribute__((noreturn)) static void die(void) {
    kill(getpid(), SIGKILL);
    for (;;) pause();
}

/* Counts a call on `path`, and says what becomes of it. */
static enum outcome outcome(const char *path, int is_write) {
    const char *below = getenv("FAIL_BELOW"), *how = getenv("FAIL_HOW");
    if (!below || !path || !strstr(path, below)) return PASS;
    long number = ++calls;
    const char *at = getenv("FAIL_AT"), *from = getenv("FAIL_FROM");
    int is_hit = (at && number == atol(at)) || (from && number >= atol(from));
    if (!is_hit || !how) return PASS;
    if (!strcmp(how, "kill") || (!strcmp(how, "torn") && !is_write)) die();
    if (!strcmp(how, "torn")) return TORN;
    if (!strcmp(how, "short")) return is_write ? SHORT : PASS;
    errno = atoi(how);
    return FAIL;
}

static enum outcome outcome_of(int file, int is_write) {
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    ssize_t length = readlink(link, path, sizeof path - 1);
    if (length < 0) return PASS;
    path[length] = 0;
    return outcome(path, is_write);
}

#define REAL(result, name, ...) \
    static result (*real)(__VA_ARGS__); \
    if (!real) real = (result(*)(__VA_ARGS__))dlsym(RTLD_NEXT, name)

#define WRITING(call, half) \
    switch (outcome_of(file, 1)) { \
    case FAIL: return -1; \
    case SHORT: if (count > 1) return half; return call; \
    case TORN: (void)!half; die(); \
    default: return call; \
    }

ssize_t write(int file, const void *bytes, size_t count) {
    REAL(ssize_t, "write", int, const void *, size_t);
    WRITING(real(file, bytes, count), real(file, bytes, count / 2))
}

ssize_t pwrite64(int file, const void *bytes, size_t count, off64_t at) {
    REAL(ssize_t, "pwrite64", int, const void *, size_t, off64_t);
    WRITING(real(file, bytes, count, at), real(file, bytes, count / 2, at))
}

ssize_t writev(int file, const struct iovec *parts, int count) {
    REAL(ssize_t, "writev", int, const struct iovec *, int);
    WRITING(real(file, parts, count), real(file, parts, count / 2))
}

#define ON_FILE(name) \
    int name(int file) { \
        REAL(int, #name, int); \
        return outcome_of(file, 0) == PASS ? real(file) : -1; \
    }
ON_FILE(fsync)
ON_FILE(fdatasync)

int ftruncate64(int file, off64_t length) {
    REAL(int, "ftruncate64", int, off64_t);
    return outcome_of(file, 0) == PASS ? real(file, length) : -1;
}

int flock(int file, int operation) {
    REAL(int, "flock", int, int);
    return outcome_of(file, 0) == PASS ? real(file, operation) : -1;
}

int rename(const char *from, const char *to) {
    REAL(int, "rename", const char *, const char *);
    return outcome(to, 0) == PASS ? real(from, to) : -1;
}

int unlink(const char *path) {
    REAL(int, "unlink", const char *);
    return outcome(path, 0) == PASS ? real(path) : -1;
}

int mkdir(const char *path, mode_t mode) {
    REAL(int, "mkdir", const char *, mode_t);
    return outcome(path, 0) == PASS ? real(path, mode) : -1;
}

#define OPENING(name) \
    int name(const char *path, int flags, ...) { \
        REAL(int, #name, const char *, int, ...); \
        va_list rest; \
        va_start(rest, flags); \
        mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0; \
        va_end(rest); \
        return outcome(path, 0) == PASS ? real(path, flags, mode) : -1; \
    }
OPENING(open)
OPENING(open64)

ssize_t read(int file, void *bytes, size_t count) {
    REAL(ssize_t, "read", int, void *, size_t);
    return outcome_of(file, 0) == FAIL ? -1 : real(file, bytes, count);
}

ssize_t pread64(int file, void *bytes, size_t count, off64_t at) {
    REAL(ssize_t, "pread64", int, void *, size_t, off64_t);
    return outcome_of(file, 0) == FAIL ? -1 : real(file, bytes, count, at);
}

__attribute__((destructor)) static void tell(void) {
    const char *path = getenv("FAIL_COUNT");
    FILE *file = path ? fopen(path, "w") : NULL;
    if (file) {
        fprintf(file, "%ld\n", (long)calls);
        fclose(file);
    }
}
