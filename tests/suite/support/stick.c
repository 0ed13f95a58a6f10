/* stick PROCESS THREAD: sends SIGUSR1 to that thread alone. */
#define _GNU_SOURCE
#include <signal.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <unistd.h>

int main(int count, char **words) {
    return count == 3 ? (int)syscall(SYS_tgkill, atoi(words[1]), atoi(words[2]), SIGUSR1) : 2;
}
