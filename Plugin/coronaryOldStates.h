#ifndef coronaryOldStates_h
#define coronaryOldStates_h

/**
 * From now on states of version 1 (.pvsm) load as states of this one: proxies that are parts of others now become
 * those, settings that were two properties become one, and one warning names what the state sets and the program
 * does not know any more, with what to do. ParaView alone passes over such properties without a word.
 */
void coronaryReadOldStates();

#endif
